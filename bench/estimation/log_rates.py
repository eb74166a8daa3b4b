"""What estimates hold at the rates of autopilots' logs.

    python -m bench.estimation.log_rates --page docs/results/log_rates.md

Bundled simulated flights are thinned out to what a log would keep: the IMU, attitude, airspeed, density and commands
at its rates, without vanes. The log goes the way of every log (the airspeed completed by the IMU, the commands on lines
between samples), is replayed, and compared with the truth. The aircraft file is off by a draw from its tolerances.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.batch.identify import METHODS, identify
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.settings import BatchSettings
from sysid_node.flight.align import flight_record
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.commands import read_commands
from sysid_node.flight.frames import quaternion_from_euler
from sysid_node.flight.logs.autopilot_log import AutopilotLog, LoggedCommands, Signal, absent
from sysid_node.flight.logs.fractions import between_commands
from sysid_node.flight.logs.log_streams import flight_of_log
from sysid_node.flight.record import Array
from sysid_node.flight.streams import COMMANDS, Stamps, Streams, in_order_of_logging
from sysid_node.flight.truth import read_truth
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import DerivativeEstimate

Estimate = DerivativeEstimate | ParameterEstimate

BAGS = Path(__file__).resolve().parents[2] / "bags"
#: Time constant of the servos in the bundled flights, s (bags/make.py).
SERVO_LAG = 0.04

#: Table -> flights, and whether vanes were logged at their full rate.
TABLES = (
    ("smooth", ("cdrw_random", "cdfp_random"), True),
    ("steps", ("cdrw_multistep", "cdfp_multistep"), True),
    ("steps without vanes", ("cdrw_multistep", "cdfp_multistep"), False),
)


class Rates(NamedTuple):
    """Rates of a log, Hz; 0 = every sample."""

    imu: float = 0.0
    attitude: float = 0.0
    airspeed: float = 0.0
    commands: float = 0.0


LOGS: Mapping[str, Rates] = {
    "all at full rate": Rates(),
    "commands 100 Hz alone": Rates(commands=100),
    "commands 50 Hz (PX4's torque setpoint by default), airspeed 5 Hz": Rates(0, 20, 5, 50),
    "commands 25 Hz, airspeed 10 Hz, IMU 50 Hz (ArduPilot's default)": Rates(50, 25, 10, 25),
    "commands 20 Hz, airspeed 5 Hz": Rates(0, 20, 5, 20),
    "commands 10 Hz (PX4's actuator_servos by default), airspeed 5 Hz": Rates(0, 20, 5, 10),
    "airspeed 2 Hz alone": Rates(airspeed=2),
    "airspeed 1 Hz alone": Rates(airspeed=1),
    "IMU 10 Hz alone": Rates(imu=10),
}


def thinned(signal: Signal, rate: float) -> Signal:
    """The samples that a logger keeps that takes the last one at every period."""
    if not rate:
        return signal
    ticks = (signal.stamp_ns - signal.stamp_ns[0]) * rate // 1_000_000_000
    return signal.selected(np.diff(ticks, prepend=-1) > 0)


def logged(bag: Path, rates: Rates, *, vanes: bool) -> Streams:
    """The flight of a bag as an autopilot logs it and the program reads it."""
    streams = read_streams(bag)
    imu, air = streams.imu, streams.air_data
    stamps: Stamps = imu.arrival.stamp_ns
    wxyz: Array = np.roll(quaternion_from_euler(imu.attitude, "frd"), 1, axis=1)
    told = read_commands(bag)
    if told:
        names = told[0].names
        commands = Signal("commands", np.array([m.stamp_ns for m in told]), np.array([m.positions for m in told]))
    else:
        names = streams.actuators.names
        commands = Signal("commands", streams.actuators.arrival.stamp_ns, streams.actuators.positions)
    log = AutopilotLog(
        name=bag.name,
        autopilot="simulated",
        imu=thinned(Signal("imu", stamps, imu.values), rates.imu),
        attitude=thinned(Signal("attitude", stamps, wxyz), rates.attitude),
        airspeed=thinned(Signal("airspeed", air.arrival.stamp_ns, air.values[:, :1]), rates.airspeed),
        density=thinned(Signal("air", air.arrival.stamp_ns, air.values[:, 3:]), 5.0),
        controls=LoggedCommands(names, thinned(commands, rates.commands)),
        outputs=LoggedCommands((), absent("outputs", 0)),
        vanes=Signal("vanes", air.arrival.stamp_ns, air.values[:, 1:3]) if vanes else None,
    )
    made = flight_of_log(log).streams
    return in_order_of_logging(replace(made, actuators=between_commands(replace(made.actuators, content=COMMANDS))))


def drawn(aircraft: Aircraft, seed: int) -> Aircraft:
    """The aircraft as a file describes it whose derivatives are as wrong as its tolerances say, but not its servos."""
    rng = np.random.default_rng([seed, 1])
    derivatives = {
        name: replace(d, value=d.value + (d.tolerance or 0.0) * rng.standard_normal())
        for name, d in aircraft.derivatives.items()
    }
    lag = dict.fromkeys(aircraft.controls, UncertainValue(SERVO_LAG, 0.0))
    return replace(aircraft, derivatives=derivatives, effects={"actuator_lag": lag})


def estimated(aircraft: Aircraft, streams: Streams, method: str) -> Mapping[str, Estimate]:
    """The estimates of all derivatives at the end of a flight, by the replay or by a batch method."""
    if method != "replay":
        record = flight_record(aircraft, streams, OnlineSettings().max_gap, "commands")
        return identify(method, aircraft, [record], BatchSettings(actuators="commands")).fit.estimates
    settings = OnlineSettings()
    aligned = align_streams(aircraft, streams, settings.max_gap, "commands")
    time, interval = aligned.time, streams.actuators.interval
    samples, begin = aligned.samples, aligned.commands_from
    found = run(aircraft, settings, time, samples, time[-1:], commands_from=begin, command_interval=interval)
    return found[-1].derivatives


class Outcome(NamedTuple):
    """One derivative: whether it is marked valid, whether the interval holds the truth, error over tolerance."""

    name: str
    valid: bool
    holds: bool
    error: float


def outcomes(flight: str, rates: Rates, seed: int, method: str, *, vanes: bool, ideal: bool) -> list[Outcome]:
    """Of all derivatives of a flight."""
    truth, known = read_truth(BAGS / flight), load_aircraft(flight[:4])
    streams = logged(BAGS / flight, rates, vanes=vanes)
    found = []
    for row in estimated(replace(drawn(known, seed), ideal=ideal), streams, method).values():
        if row.name not in truth or row.name.endswith("_0"):
            continue
        tolerance = known.derivatives[row.name].tolerance or 1.0
        off = row.value - truth[row.name]
        found.append(Outcome(row.name, row.valid, row.lower <= truth[row.name] <= row.upper, abs(off) / tolerance))
    return found


def main() -> None:
    """Prints or publishes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--ideal", action="store_true", help="intervals without what tolerances add to them")
    parser.add_argument("--method", default="replay", choices=("replay", *METHODS))
    parser.add_argument("--table", choices=[name for name, *_ in TABLES], help="this one alone")
    args = parser.parse_args()
    for name, flights, vanes in TABLES:
        if args.table not in (None, name):
            continue
        rows = [
            _row(label, rates, flights, args.seeds, args.method, vanes=vanes, ideal=args.ideal)
            for label, rates in LOGS.items()
        ]
        heads = ("log", "valid", "of these hold the truth", "median error of all, in tolerances", "of the valid")
        section = f"bench/estimation/log_rates.py {name}" + ("" if args.method == "replay" else f" {args.method}")
        publish(section, table(heads, rows), args.page)


def _row(
    label: str, rates: Rates, flights: Sequence[str], seeds: int, method: str, *, vanes: bool, ideal: bool
) -> tuple[str, ...]:
    every = [
        one
        for flight in flights
        for seed in range(seeds)
        for one in outcomes(flight, rates, seed, method, vanes=vanes, ideal=ideal)
    ]
    valid = [one for one in every if one.valid]
    holds = f"{100.0 * sum(one.holds for one in valid) / len(valid):.0f} %" if valid else "-"
    errors = [f"{np.median([one.error for one in some]):.2f}" if some else "-" for some in (every, valid)]
    row = (label, f"{len(valid)} of {len(every)}", holds, *errors)
    print(*row, sep="  ", flush=True)
    return row


if __name__ == "__main__":
    main()
