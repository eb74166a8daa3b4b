"""Whether intervals hold where an ordinary imperfection is not in the aircraft file.

    python -m bench.estimation.imperfections

Flights as a user makes them with `sysid simulate --aircraft cdrw --manoeuvre 3211:repeat=3`, each with noise of its own
and one effect of the ordinary size. Each is replayed twice: from exactly stamped positions at 200 Hz, and from the
commands of the autopilot at 100 Hz, which are all that most aircraft record. The aircraft file knows nothing of the
effect. Counted are, among 27 derivatives, those that are valid at the end, the 95 % intervals of these that hold the
truth, and those that are more than four standard errors off.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.streams import Streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import Sortie, SortieConditions, fly_sortie

AIRCRAFT = "cdrw"
MANOEUVRE = "3211:repeat=3"
RATE, COMMAND_RATE, POSITION_RATE = 1000.0, 100.0, 200.0  # Hz, of the simulation, the autopilot, measured positions

#: Name of the row -> effects as of `sysid simulate --effect`.
IMPERFECTIONS = {
    "nothing at all": (),
    "`actuator_lag` 10 ms": ("actuator_lag:time_constant=0.01",),
    "`actuator_lag` 30 ms": ("actuator_lag:time_constant=0.03",),
    "`command_delay` 20 ms": ("command_delay:delay=0.02",),
    "`actuator_rate_limit` 2 rad/s": ("actuator_rate_limit:rate=2",),
    "`imu_delay` 10 ms": ("imu_delay:delay=0.01",),
    "`air_data_delay` 20 ms": ("air_data_delay:delay=0.02",),
    "`air_data_lag` 50 ms": ("air_data_lag:time_constant=0.05",),
    "`vane_scale` 3 %": ("vane_scale:alpha=0.03:beta=0.03",),
    "`airspeed_scale` 2 %": ("airspeed_scale:error=0.02",),
    "`imu_scale` 1 % (rates)": ("imu_scale:p=0.01:q=0.01:r=0.01",),
    "`imu_misalignment` 0.01 rad": ("imu_misalignment:roll=0.01:pitch=0.01:yaw=0.01",),
    "`imu_lever_arm` 5 cm": ("imu_lever_arm:x=0.05",),
    "`vane_lever_arm` 10 cm": ("vane_lever_arm:x=0.1",),
    "`mass_error` 2 %": ("mass_error:error=0.02",),
    "`inertia_error` 5 %": ("inertia_error:Ixx=0.05:Iyy=0.05:Izz=0.05",),
}


@dataclass
class Count:
    """Derivatives of all flights together."""

    valid: int = 0
    hold: int = 0
    far: int = 0

    def add(self, estimates: Estimates, truth: dict[str, float]) -> None:
        """Count the derivatives of one flight."""
        for name, one in estimates.derivatives.items():
            if one.valid:
                self.valid += 1
                self.hold += one.lower <= truth[name] <= one.upper
                self.far += abs(one.value - truth[name]) > 4.0 * one.standard_error

    def cells(self, flights: int) -> list[str]:
        """Mean number of valid ones in a flight, and shares of these that hold, and that are far off."""
        if not self.valid:
            return ["0", "-", "-"]
        shares = (f"{100.0 * n / self.valid:.0f} %" for n in (self.hold, self.far))
        return [f"{self.valid / flights:.1f}", *shares]


def fly(effects: Sequence[str], seed: int, turbulence: str) -> Sortie:
    """One flight at the hands of the autopilot."""
    simulator = Simulator(load_aircraft(AIRCRAFT), RATE)
    plan = parse_manoeuvre(MANOEUVRE, simulator.aircraft, RATE)
    moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    conditions = SortieConditions(tuple(effects), turbulence=turbulence, seed=seed, command_rate=COMMAND_RATE)
    return fly_sortie(simulator, moves, conditions)


def estimated(streams: Streams, carried: str) -> Estimates:
    """The estimates at the end of the flight."""
    aircraft, settings = load_aircraft(AIRCRAFT), OnlineSettings(actuators=carried)
    aligned = align_streams(aircraft, streams, settings.max_gap, carried)
    time, end = aligned.time, aligned.time[-1:]
    return run(aircraft, settings, time, aligned.samples, end, commands_from=aligned.commands_from)[-1]


def row(name: str, flights: int, turbulence: str) -> list[str]:
    """One imperfection: valid, hold, far off from positions, then from commands."""
    positions, commands = Count(), Count()
    for seed in range(1, flights + 1):
        sortie = fly(IMPERFECTIONS[name], seed, turbulence)
        measured = FlightSampler(actuator_rate=POSITION_RATE, surfaces="measured").record(sortie)
        positions.add(estimated(measured, "positions"), sortie.derivatives)
        commands.add(estimated(FlightSampler().record(sortie), "auto"), sortie.derivatives)
    cells = [name, *positions.cells(flights), *commands.cells(flights)]
    print(" | ".join(cells), file=sys.stderr, flush=True)  # a long bench says how far it is
    return cells


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=20, help="of each imperfection (default: 20)")
    parser.add_argument("--turbulence", default="none", help="none, light or moderate (default: none)")
    parser.add_argument("--only", choices=IMPERFECTIONS, help="one imperfection")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    heads = ("imperfection", "positions: valid", "hold", "> 4 s.e.", "commands: valid", "hold", "> 4 s.e.")
    names = [args.only] if args.only else IMPERFECTIONS
    text = table(heads, (row(name, args.flights, args.turbulence) for name in names))
    said = f"Flights in each row: {args.flights}; turbulence: {args.turbulence}."
    publish("bench/estimation/imperfections.py", f"{said}\n\n{text}", args.page)


if __name__ == "__main__":
    main()
