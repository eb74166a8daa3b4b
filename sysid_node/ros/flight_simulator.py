"""The node `flight_simulator`: an aircraft that flies in real time, or faster, and is flown over topics.

This module imports nothing that simulation needs, so that one line says where that is not installed.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.util import find_spec

from rclpy.node import Node

from sysid_node.errors import InputError
from sysid_node.parameter import NodeParameter
from sysid_node.ros.support.spin import run_node


def main() -> None:
    """Entry point of the node."""
    about = "Flies an aircraft in real time, or faster, and is flown over topics."
    sys.exit(run_node(_make, about, _table() if {"-h", "--help"} & set(sys.argv[1:]) else ()))


def _table() -> Sequence[NodeParameter]:
    if find_spec("jax") is None:
        return ()
    from sysid_node.ros.support.simulated_flight import PARAMETERS  # noqa: PLC0415  # JAX may be missing

    return PARAMETERS


def _make() -> Node:
    missing = [name for name in ("jax", "scipy") if find_spec(name) is None]
    if missing:
        raise InputError(
            f"flight_simulator needs {' and '.join(missing)}, not installed here: pip install -r requirements/desk.txt"
        )
    from sysid_node.ros.support.simulated_flight import FlightSimulator  # noqa: PLC0415  # JAX may be missing

    return FlightSimulator()


if __name__ == "__main__":
    main()
