"""Whether the fault monitor names a servo that reaches its rate limit, where only commands are recorded.

    python -m bench.estimation.rate_limits [--flights 2] [--page docs/results/faults.md]

The plant is written apart from the package (`bench/withheld/plants`). An autopilot holds `cdrw` while 3-2-1-1s move one
surface after the other for 80 s, small ones that hardly reach the limits or large ones that do. The servos are of
second order at 8 Hz, and all of them have the same rate limit, or none. The aircraft file says nothing of servos and is
off by its tolerances.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.estimation.servo_flights import flown
from bench.pages import publish, table
from sysid_node.faults.recorded_flight import judge
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import RATE_LIMITED, Fault

AMPLITUDES = {"small": (0.06, 0.06, 0.06), "large": (0.12, 0.15, 0.2)}  # rad, of elevator, aileron, rudder
CONTROLS = ("elevator", "aileron", "rudder")
#: Limit (rad/s), and size of the manoeuvres.
CASES = (
    (None, "small"),
    (None, "large"),
    (2.0, "small"),
    (2.0, "large"),
    (3.0, "large"),
    (4.0, "large"),
    (6.0, "large"),
)
AIRS = ("none", "light")


def named(limit: float | None, size: str, air: str, seed: int) -> list[Fault]:
    """The servos that the monitor says are at their limits in one flight."""
    moves = [f"3211:{CONTROLS[i % 3]}:amplitude={AMPLITUDES[size][i % 3]}:start={2 + 6 * i}" for i in range(12)]
    effects = {} if limit is None else {"actuator_rate_limit": {"rate": limit}}
    file, streams = flown(moves, effects, air, seed)
    verdict = judge(file, FaultMonitorSettings(), streams)
    return [e.fault for e in verdict.episodes if e.fault.kind == RATE_LIMITED]


def row(limit: float | None, size: str, air: str, flights: Sequence[list[Fault]]) -> list[str]:
    """One line of the table."""
    cells = []
    for control in CONTROLS:
        mine = [fault for faults in flights for fault in faults if fault.part == control]
        cells.append(f"{sum(any(f.part == control for f in faults) for faults in flights)} of {len(flights)}")
        cells[-1] += f": {np.median([fault.size for fault in mine]):.1f}" if mine else ""
    every = [fault for faults in flights for fault in faults]
    holds = sum(fault.lower <= (limit or 0.0) <= fault.upper for fault in every)
    first = f"{np.median([fault.found for fault in every]):.0f}" if every else "-"
    words = "none" if limit is None else f"{limit:g}"
    return [f"{words}; {size}; {air}", *cells, first, f"{holds} of {len(every)}" if every else "-"]


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=2, help="of each case")
    parser.add_argument("--first", type=int, default=1, help="number of the first flight")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    numbers, rows = range(args.first, args.first + args.flights), []
    for limit, size in CASES:
        for air in AIRS:
            rows.append(row(limit, size, air, [named(limit, size, air, number) for number in numbers]))
            print(*rows[-1], sep=" | ", flush=True)
    heads = ("limit, rad/s; 3-2-1-1; turbulence", *(f"{name} named: rad/s" for name in CONTROLS))
    publish(
        "bench/estimation/rate_limits.py",
        table((*heads, "found at s: median", "limit in the interval"), rows),
        args.page,
    )


if __name__ == "__main__":
    main()
