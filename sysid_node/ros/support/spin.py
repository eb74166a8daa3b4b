"""Runs a ROS program until it is done or stopped."""

from __future__ import annotations

import gc
import signal
from collections.abc import Callable

import rclpy
from rclpy.exceptions import NotInitializedException
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from sysid_node.errors import InputError


def run_program(program: Callable[[], None]) -> int:
    """Run ``program`` with ROS initialised; returns the exit code.

    The code is 0 where it is done, or was stopped by Ctrl-C, SIGTERM or a shutdown of its context. It is 2 where it
    raises InputError, or ROS refuses its arguments; the log then holds one line. Ctrl-C shuts ROS down, as SIGTERM
    does, and ``program`` must end when ``rclpy.ok()`` is false. There is no KeyboardInterrupt, because in the middle
    of rclpy's conversion of a message one becomes a RuntimeError.
    """
    signal.signal(signal.SIGINT, lambda *_: None)  # ROS's own handler, added next, calls this one
    try:
        rclpy.init()
    except (rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as error:
        rclpy.logging.get_logger("sysid").fatal(f"arguments after --ros-args: {' '.join(str(error).split())}")
        return 2
    try:
        program()
    except InputError as error:
        rclpy.logging.get_logger("sysid").fatal(str(error))
        return 2
    except ExternalShutdownException:
        pass
    except (rclpy_implementation.RCLError, rclpy_implementation.InvalidHandle, NotInitializedException):
        if rclpy.ok():
            raise  # otherwise ROS was shutting down
    finally:
        rclpy.try_shutdown()
    return 0


def serve(node: Node) -> None:
    """Serve a node's callbacks until ROS is shut down, then destroy it.

    The events executor takes a third of the processor time of the single-threaded one; its ``spin`` hangs, hence
    ``spin_once``.
    """
    executor = EventsExecutor()
    executor.add_node(node)
    gc.freeze()  # modules stay, so that the collector need not scan them while messages wait
    try:
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.1)
    finally:
        node.destroy_node()
