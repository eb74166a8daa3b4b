"""Runs a ROS program until it is done or told to stop."""

from __future__ import annotations

import gc
from collections.abc import Callable

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from sysid_node.errors import InputError


def run_program(program: Callable[[], None]) -> int:
    """Run ``program`` with ROS initialised; returns the exit code.

    0 when it is done or stopped by Ctrl-C, SIGTERM or a shutdown of its context; 2 where it raises InputError, or ROS
    cannot make sense of its arguments, which becomes one line of the log.
    """
    try:
        rclpy.init()
        program()
    except InputError as error:
        rclpy.logging.get_logger("sysid").fatal(str(error))
        return 2
    except (rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as error:
        if rclpy.ok():
            raise
        rclpy.logging.get_logger("sysid").fatal(f"arguments after --ros-args: {' '.join(str(error).split())}")
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
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
    gc.freeze()  # modules stay: the collector need not go through them while messages wait
    try:
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.1)
    finally:
        node.destroy_node()
