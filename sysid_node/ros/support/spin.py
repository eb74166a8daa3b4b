"""Runs a ROS program until it is done or stopped."""

from __future__ import annotations

import gc
import signal
import sys
import textwrap
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import rclpy
from rclpy.exceptions import NotInitializedException
from rclpy.executors import Executor, ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from sysid_node.errors import InputError
from sysid_node.parameter import NodeParameter

#: What rclpy raises where ROS has been shut down.
_AT_SHUTDOWN = (
    ExternalShutdownException,
    NotInitializedException,
    rclpy_implementation.InvalidHandle,
    rclpy_implementation.RCLError,
)
#: Held while ROS must not be shut down by a signal.
_staying_up = threading.Lock()


def run_node(make: Callable[[], Node], about: str, table: Sequence[NodeParameter] = ()) -> int:
    """Make a node and serve it until it is stopped; returns the exit code (see ``run_program``).

    With ``--help`` it prints what the node is ``about`` and its ``table`` of parameters.
    """
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(help_text(Path(sys.argv[0]).stem, about, table))
        return 0
    return run_program(lambda: serve(make()))


def help_text(name: str, about: str, table: Sequence[NodeParameter]) -> str:
    """The help of a node: how to start it, what it does, its parameters with their defaults."""
    lines = [f"usage: ros2 run sysid_node {name} --ros-args [-p NAME:=VALUE]... [--params-file FILE]", ""]
    lines += [about.strip(), "", "parameters (default):"]
    for one in table:
        allowed = f" Values: {one.constraint}." if one.constraint else ""
        unit = f" Unit: {one.unit}." if one.unit and not allowed else ""
        default = '""' if one.default == "" else one.default
        text = f"{one.name} ({default}): {one.meaning}{allowed}{unit}"
        lines += textwrap.wrap(text, 110, initial_indent="  ", subsequent_indent="      ")
    lines += ["", f"config/{name}.yaml is a file of all of them; topics and services: docs/reference/topics.md"]
    return "\n".join(lines)


def run_program(program: Callable[[], None]) -> int:
    """Run ``program`` with ROS initialised; returns the exit code.

    The code is 0 where it is done, or was stopped by Ctrl-C, SIGTERM or a shutdown of its context. It is 2 where it
    raises InputError, or ROS refuses its arguments; the log then holds one line. Ctrl-C shuts ROS down, as SIGTERM
    does, and ``program`` must end when ``rclpy.ok()`` is false. There is no KeyboardInterrupt, because in the middle
    of rclpy's conversion of a message one becomes a RuntimeError.
    """
    told: SimpleQueue[None] = SimpleQueue()  # a handler of signals may put into it
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, lambda *_: told.put(None))
    try:
        # rclpy's own handlers miss what comes while ROS begins, and shut it down in the middle of ``take_up``.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except (rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as error:
        _logger().fatal(f"arguments after --ros-args: {' '.join(str(error).split())}")
        return 2
    stopper = threading.Thread(target=_shut_down_once, args=(told, rclpy.get_default_context().handle))
    stopper.start()
    try:
        with until_shutdown():
            program()
    except InputError as error:
        _logger().fatal(str(error))
        return 2
    finally:
        with _staying_up:
            rclpy.try_shutdown()
        told.put(None)
        stopper.join()
        for one in (signal.SIGINT, signal.SIGTERM):  # a second Ctrl-C while Python ends would be its exit code
            signal.signal(one, signal.SIG_IGN)
    return 0


def _logger() -> RcutilsLogger:
    """The log of a program that has no node, or none any more, by the program's name."""
    return rclpy.logging.get_logger(Path(sys.argv[0]).stem or "sysid")


def _shut_down_once(told: SimpleQueue[None], handle: Any) -> None:
    """Shut ROS down once the program is told to stop, as rclpy's own handler of signals does.

    What ``rclpy.shutdown`` does beside that, such as the end of logging, waits until nodes are destroyed.
    """
    told.get()
    with _staying_up, until_shutdown(), handle:
        if handle.ok():
            handle.shutdown()


def take_up(executor: Executor, node: Node) -> None:
    """Have an executor add a node and its parts.

    ROS stays up meanwhile: where it is shut down in the middle, rclpy's events executor aborts the process.
    """
    executor.add_node(node)
    with _staying_up:
        if rclpy.ok():
            executor.spin_once(timeout_sec=0.0)


@contextmanager
def until_shutdown() -> Iterator[None]:
    """A context that ends quietly where ROS is shut down in it, at whatever moment.

    A call that finds ROS shut down raises one of several exceptions; while ROS is up, they are raised.
    """
    try:
        yield
    except _AT_SHUTDOWN:
        if rclpy.ok():
            raise


def while_ros_is_up(node: Node, callback: Callable[..., Any]) -> Callable[..., Any]:
    """The callback, whose exceptions are left out once ROS is shutting down: its calls may fail by then.

    Else Ctrl-C in the middle of a callback would be reported as FATAL, with a traceback.
    """

    def call(*arguments: Any) -> Any:
        try:
            return callback(*arguments)
        except Exception:
            if node.context.ok():
                raise
            return None

    return call


def serve(node: Node) -> None:
    """Serve a node's callbacks until ROS is shut down, then destroy it.

    The events executor takes a third of the processor time of the single-threaded one; its ``spin`` hangs, hence
    ``spin_once``.
    """
    executor = EventsExecutor()
    gc.freeze()  # modules stay, so that the collector need not scan them while messages wait
    try:
        take_up(executor, node)
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.1)
    finally:
        # A collection in the middle of the destruction of rclpy's handles has ended a process by a segmentation fault
        # (as in ros2/rclpy issue 1644); what is left to collect ends with the process.
        gc.disable()
        node.destroy_node()
        gc.freeze()  # the collection at the end of the process leaves them out, too
