"""The aircraft that a node is told of by its parameter ``aircraft``."""

from __future__ import annotations

import warnings

from rclpy.node import Node

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError, ModelWarning


def aircraft_of(node: Node, name_or_path: str) -> Aircraft:
    """The aircraft; what is doubtful in its file is said in the node's log. Raises InputError where there is none."""
    if not name_or_path:
        raise InputError("parameter aircraft is empty: give a name or a file, e.g. --ros-args -p aircraft:=cdrw")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", ModelWarning)
        aircraft = load_aircraft(name_or_path)
    for one in told:
        node.get_logger().warning(str(one.message))
    return aircraft
