"""What the programs that show a flight while it is flown have in common: help, parameters, and listening to ROS."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from sysid_node.errors import InputError
from sysid_node.parameter import NodeParameter, check_each

if TYPE_CHECKING:
    from sysid_node.ros.support.flight_watch import FlightWatch

NICE = 10  # lower priority than the identifier's: on a busy computer the picture waits, not the flight


def run_viewer(name: str, about: str, table: Sequence[NodeParameter], serve: Callable[[], None]) -> None:
    """The entry point of a program: its help, or ``serve`` with ROS initialised; it ends the process."""
    import sysid_node.ros  # noqa: F401, PLC0415  # finds sysid_msgs in a virtual environment
    from sysid_node.ros.support.spin import help_text, run_program  # noqa: PLC0415

    if {"-h", "--help"} & set(sys.argv[1:]):
        print(help_text(name, about, table))
        return
    sys.exit(run_program(serve))


@contextmanager
def watched_flight(
    table: Sequence[NodeParameter], name: str = "view"
) -> Iterator[tuple[FlightWatch, Mapping[str, Any]]]:
    """What listens to the flight, and the values of the program's parameters. Raises InputError without an aircraft.

    ``name`` is that of the ROS node. The process gets a low priority.
    """
    from sysid_node.ros.support.declaring import declare, values_of  # noqa: PLC0415
    from sysid_node.ros.support.flight_watch import FlightWatch  # noqa: PLC0415

    os.nice(NICE)
    watch = FlightWatch(name=name)
    try:
        declare(watch.node, table, partial(check_each, table))
        given = values_of(watch.node, table)
        if not given["aircraft"]:
            raise InputError("parameter aircraft is empty: give a name or a file, e.g. --ros-args -p aircraft:=cdrw")
        watch.frame = given["body_frame"]
        yield watch, given
    finally:
        watch.close()
