"""What is lost without vanes: the same flights identified with and without flow angles.

    python -m bench.estimation.no_vanes

The flights are those of `bench/estimation/coverage.py`. In the estimator's aircraft file every derivative is off by a
draw from its tolerance, a new one for each flight, because the reconstruction of the flow angles uses the file.
Estimates are those after 60 s that are marked valid.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.estimation.judging import FLIGHTS_A_TASK, Array, judge, processes
from bench.estimation.simulated_flights import Setting, fly
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates

AIRCRAFT = "cdrw"
TIME = np.array([59.99])  # s
SETTINGS = (
    Setting("still air", autopilot=False),
    Setting("light turbulence", "light", autopilot=False),
)
ANGLES = [SAMPLE_COLUMNS.index(name) for name in ("alpha", "beta")]


def drawn(aircraft: Aircraft, seed: int) -> Aircraft:
    """The aircraft as a file that is as wrong as its tolerances say describes it."""
    rng = np.random.default_rng([seed, 1])
    derivatives = {
        name: replace(d, value=d.value + (d.tolerance or 0.0) * rng.standard_normal())
        for name, d in aircraft.derivatives.items()
    }
    return replace(aircraft, derivatives=derivatives)


def both(setting: Setting, seeds: Sequence[int]) -> Array:
    """(2, F, D, 5) estimates with and without vanes, see ``evaluation.judging``."""
    batch, known = fly(AIRCRAFT, setting, seeds), load_aircraft(AIRCRAFT)
    blind = batch.samples.copy()
    blind[..., ANGLES] = np.nan
    return np.array(
        [
            [
                _numbers(run(drawn(known, seed), OnlineSettings(), batch.time, flight, TIME)[0])
                for seed, flight in zip(seeds, samples, strict=True)
            ]
            for samples in (batch.samples, blind)
        ]
    )


def _numbers(found: Estimates) -> list[list[float]]:
    """(D, 5) value, standard error, lower, upper, valid, in the file's order."""
    derivatives = [found.derivatives[name] for name in load_aircraft(AIRCRAFT).derivatives]
    return [[d.value, d.standard_error, d.lower, d.upper, float(d.valid)] for d in derivatives]


def compare(setting: Setting, found: Array) -> str:
    """The table of one setting: found (2, F, D, 5)."""
    rows = []
    for d, (name, truth) in enumerate(load_aircraft(AIRCRAFT).derivatives.items()):
        cells = [name]
        for several in found[:, :, d]:
            v = judge(several, truth.value)
            error = 100 * float(np.median(several[:, 1])) / abs(truth.value)
            said = [f"{100 * v.coverage:.0f}", f"{100 * (v.mean / truth.value - 1):+.1f}"] if v.valid > 1 else ["-"] * 2
            cells += [f"{100 * v.share_valid:.0f}", f"{error:.1f}", *said]
        rows.append(cells)
    heads = [f"{what}{where}" for where in ("", ", no vanes") for what in ("valid %", "s.e. %", "coverage %", "bias %")]
    return f"{setting.name[0].upper()}{setting.name[1:]}, {found.shape[1]} flights:\n\n{table(['', *heads], rows)}"


def main() -> None:
    """Print the tables, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=100, help="a setting (default: 100)")
    parser.add_argument("--setting", choices=[s.name for s in SETTINGS], help="only this one")
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    seeds = (np.arange(args.flights) + 1).tolist()
    parts = [seeds[i : i + FLIGHTS_A_TASK] for i in range(0, len(seeds), FLIGHTS_A_TASK)]
    with processes() as pool:
        for setting in SETTINGS:
            if args.setting in (None, setting.name):
                found = np.concatenate(list(pool.map(partial(both, setting), parts)), axis=1)
                publish(f"bench/estimation/no_vanes.py {setting.name}", compare(setting, found), args.page)


if __name__ == "__main__":
    main()
