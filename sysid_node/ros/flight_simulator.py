"""The node `flight_simulator`: an aircraft that flies in real time, or faster, and is flown over topics.

This module imports nothing that simulation needs, so that one line says where that is not installed.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec

from sysid_node.errors import InputError
from sysid_node.ros.support.spin import run_program, serve


def main() -> None:
    """Entry point of the node."""
    sys.exit(run_program(_fly))


def _fly() -> None:
    missing = [name for name in ("jax", "scipy") if find_spec(name) is None]
    if missing:
        raise InputError(
            f"flight_simulator needs {' and '.join(missing)}, not installed here: pip install -r requirements/desk.txt"
        )
    from sysid_node.ros.support.simulated_flight import FlightSimulator  # noqa: PLC0415  # JAX may be missing

    serve(FlightSimulator())


if __name__ == "__main__":
    main()
