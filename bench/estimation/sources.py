"""What flights tell of each imperfection beside the derivatives, and whether that holds.

    python -m bench.estimation.sources [--flights 24] [--first 9101] [--aircraft cdrw kestrel] [--page FILE]

The flights are those of ``all_imperfections`` in still air, and the estimator has the commands. The table gives the
standard deviation of each imperfection after the flight as a share of that before, and the estimate's error in the
standard deviations after it. Where the share is one, the flight tells nothing, and the error is the draw itself. Those
are listed of which flights of one of the aircraft leave less than ``TOLD``. Mass, inertias and controls are not
compared, because their draws have other units than their tolerances.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.estimation.all_imperfections import MANOEUVRE, RATE, Effects, drawn, fly, known
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run_to_end
from sysid_node.online.settings import OnlineSettings
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler

TOLD = 0.9  # of the standard deviation is left

#: By the tolerance's key, or all of it but its last part: the effect that was drawn, and its parameter where it is one.
_DRAWN = {
    "delays.imu": ("imu_delay", "delay"),
    "delays.air_data": ("air_data_delay", "delay"),
    "delays.actuators": ("actuator_stamp_delay", "delay"),
    "sensors.imu": ("imu_lever_arm", ""),
    "sensors.air_data": ("vane_lever_arm", ""),
}

Rows = dict[str, list[tuple[float, float]]]  # by key, of each flight: standard deviations after over before, and error


def main() -> None:
    """Fly, and print the table or put it in a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=24, help="of each aircraft (default: 24)")
    parser.add_argument("--first", type=int, default=9101, help="number of the first flight (default: 9101)")
    parser.add_argument("--aircraft", nargs="+", default=["cdrw", "kestrel"], help="names in the catalogue")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    numbers = range(args.first, args.first + args.flights)
    found = {name: estimated(load_aircraft(name), numbers) for name in args.aircraft}
    publish("bench/estimation/sources.py", _table(found), args.page)


def estimated(aircraft: Aircraft, numbers: range) -> Rows:
    """What the flights of these numbers tell."""
    simulator, rows = Simulator(aircraft, RATE), Rows()
    settings = OnlineSettings(actuators="commands")
    for number in numbers:
        kind, effects = drawn(aircraft, number)
        streams = FlightSampler().record(fly(simulator, effects, "none", number, MANOEUVRE))
        file = known(aircraft, kind, effects, number)
        aligned = align_streams(file, streams, settings.max_gap, "commands")
        end, since = aligned.time[-1:], aligned.commands_from
        _, state = run_to_end(file, settings, aligned.time, aligned.samples, end, commands_from=since)
        imperfect, latest = state.model.imperfections, state.latest
        assert imperfect is not None and latest is not None and latest.systematic is not None
        considered = latest.systematic.considered
        errors: NDArray[np.float64] = np.sqrt(considered.covariance.diagonal())
        for source, value, error in zip(imperfect.sources, considered.estimate, errors, strict=False):
            truth = _truth(source.key, effects)
            if truth is not None:
                rows.setdefault(source.key, []).append((error / source.sigma, (value - truth) / error))
    return rows


def _truth(key: str, effects: Effects) -> float | None:
    """What was drawn of an imperfection, in the unit of its tolerance; None where none was or the unit is another."""
    effect, _, parameter = key.rpartition(".")
    name, fixed = _DRAWN.get(key) or _DRAWN.get(effect) or (effect, parameter)
    sizes: Mapping[str, float] = effects.get(name, {})
    return sizes.get(fixed or parameter)


def _table(found: Mapping[str, Rows]) -> str:
    keys = [key for key in next(iter(found.values())) if min(_left(rows[key]) for rows in found.values()) < TOLD]
    heads = ["imperfection", *(f"{name}: {word}" for name in found for word in ("left", "error, rms", "hold"))]
    body = [[f"`{key}`", *(cell for rows in found.values() for cell in _cells(rows[key]))] for key in keys]
    return table(heads, body)


def _left(rows: list[tuple[float, float]]) -> float:
    return float(np.median([left for left, _ in rows]))


def _cells(rows: list[tuple[float, float]]) -> list[str]:
    errors = np.array([error for _, error in rows])
    hold = float(np.mean(np.abs(errors) < 1.96))
    return [f"{_left(rows):.2f}", f"{np.sqrt(np.mean(errors**2)):.1f}", f"{hold:.0%}"]


if __name__ == "__main__":
    main()
