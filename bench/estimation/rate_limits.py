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
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.estimation.slow_servos import SET, SUITE
from bench.pages import publish, table
from bench.withheld.drawing import SETS, draw
from bench.withheld.plants.flying import fly
from bench.withheld.plants.instruments import SUITES, record
from bench.withheld.plants.motion import Instant
from bench.withheld.plants.pilot import Pilot
from bench.withheld.plants.plant import RATE, Plant, handed_over
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.faults.recorded_flight import judge
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import RATE_LIMITED, Fault
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden

SECONDS = 80.0
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
    drawn = replace(draw(SET, seed), plant="cdrw", effects={}, turbulence=air, servo=8.0)
    plant = Plant(drawn, SET)
    random = np.random.default_rng([SETS[SET], seed, 77])
    moves = [f"3211:{CONTROLS[i % 3]}:amplitude={AMPLITUDES[size][i % 3]}:start={2 + 6 * i}" for i in range(12)]
    airframe, plan = plant.airframe({}), parse_manoeuvre(moves, plant.truth, RATE, SECONDS)
    planned = {name: plan.deflections[name] for name in airframe.controls} | {"thrust": np.zeros(plan.time.size)}
    gusts = np.zeros((plan.time.size, 6))
    if air != "none":
        dryden = Dryden.at(100.0, plant.truth.geometry.b)
        gusts = INTENSITIES[air] * dryden.realisation(len(gusts), RATE, plant.truth.reference.airspeed, random)

    def pilot(start: Instant) -> Pilot:
        return Pilot(plant.truth, airframe.trim, start, drawn.bandwidth, random, plant.truth.throttle.max_thrust)

    limits = {name: control.limit or 0.5 for name, control in plant.truth.controls.items()}
    effects = {} if limit is None else {"actuator_rate_limit": {"rate": limit}}
    log = fly(airframe, effects, pilot, planned, gusts, limits, RATE, drawn.servo)
    file, own = handed_over(plant)
    streams = record(log, plant.seen(log, {}), plant.truth, {}, SUITES[SUITE], 1.0, own)
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
