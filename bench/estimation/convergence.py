"""How soon each derivative is known, by what is flown.

    python -m bench.estimation.convergence

Each input goes to all surfaces with the same peaks, in still air with the sensors' noise, the autopilot holding
attitude: steps on one surface after the other, sweeps and ramps too, multisines and noise on all at once. A derivative
has converged from the time on at which it stays valid and within 10 % of the truth (an offset near zero: of twice its
tolerance). Subrahmanyam, Kim and Ghosh compare inputs so; slow ones come last, and their intervals must say it.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from bench.estimation.judging import LOWER, METHODS, UPPER, VALID, VALUE, Array, many, processes
from bench.estimation.simulated_flights import Setting, multistep
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.settings import OnlineSettings

AIRCRAFT = "cdrw"
WITHIN = 0.1  # of the truth
TIMES = np.arange(2, 121) * 0.5  # s, at which estimates are looked at
EARLY = 10.0  # s, when all inputs' intervals are compared
DERIVATIVES = load_aircraft(AIRCRAFT).derivatives
TRUTH = np.array([d.value for d in DERIVATIVES.values()])
#: What an error is measured against: the derivative, or twice its tolerance where that is more (offsets near zero).
SIZES = np.array([max(abs(d.value), 2.0 * (d.tolerance or 0.0)) for d in DERIVATIVES.values()])
PEAKS = {"elevator": 0.06, "aileron": 0.06, "rudder": 0.12}  # rad
ALL = f"{','.join(PEAKS)}:amplitude={','.join(str(peak) for peak in PEAKS.values())}"


def in_turn(kind: str, first: float, apart: float, rest: str) -> tuple[str, ...]:
    """One surface after the other, ``apart`` s between them."""
    return tuple(
        f"{kind}:{surface}:amplitude={peak}:start={first + i * apart}:{rest}"
        for i, (surface, peak) in enumerate(PEAKS.items())
    )


INPUTS = {
    "3-2-1-1": multistep(60.0),
    "doublets": in_turn("doublet", 0.7, 2.0, "width=0.35:every=6:repeat=9"),
    "multisine": (f"multisine:{ALL}:length=20:low=0.1:high=2:start=0.7:every=20:repeat=2",),
    "noise": (f"random:{ALL}:length=58:low=0.1:high=2:start=0.7",),
    "sweeps": in_turn("sweep", 0.7, 19.0, "length=19:low=0.1:high=2"),
    "slow ramps": in_turn("ramp", 0.7, 6.0, "length=20:every=22:repeat=2"),
}


def convergence(estimated: Array) -> Array:
    """(F, D) s from which on each of (F, K, D, 5) estimates stays valid and near the truth; infinite: it never does."""
    good = (estimated[..., VALID] > 0) & (np.abs(estimated[..., VALUE] - TRUTH) < WITHIN * SIZES)
    stays = np.flip(np.logical_and.accumulate(np.flip(good, axis=1), axis=1), axis=1)
    return np.where(stays.any(axis=1), TIMES[np.argmax(stays, axis=1)], np.inf)


def honest(estimated: Array) -> str:
    """Of all valid estimates at all times, how many intervals hold the truth, %."""
    valid = estimated[..., VALID] > 0
    inside = (estimated[..., LOWER] <= TRUTH) & (estimated[..., UPPER] >= TRUTH)
    return f"{100 * inside[valid].mean():.1f}" if valid.any() else "-"


def compare(flights: int, method: str, pool: ProcessPoolExecutor) -> str:
    """The table: derivatives by inputs."""
    columns, ends = [], []
    for name, manoeuvre in INPUTS.items():
        setting = Setting(name, manoeuvre=manoeuvre)
        estimated = many(AIRCRAFT, setting, [METHODS[method]], TIMES, flights, pool)[0]
        times = np.median(convergence(estimated), axis=0)
        columns.append([f"{t:.1f}" if np.isfinite(t) else "-" for t in times])
        early = estimated[:, np.searchsorted(TIMES, EARLY), :, VALID] > 0
        ends.append((f"{np.isfinite(times).sum()} of {times.size}", f"{100 * early.mean():.0f}", honest(estimated)))
    rows = [[name, *row] for name, row in zip(DERIVATIVES, zip(*columns, strict=True), strict=True)]
    heads = (f"within {100 * WITHIN:.0f} % in 60 s", f"valid after {EARLY:g} s, %", "intervals that hold the truth, %")
    rows += [[f"**{head}**", *row] for head, row in zip(heads, zip(*ends, strict=True), strict=True)]
    return table(["s, median", *INPUTS], rows)


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=20, help="an input (default: 20)")
    parser.add_argument("--method", choices=METHODS, default=OnlineSettings().method)
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    with processes() as pool:
        publish("bench/estimation/convergence.py", compare(args.flights, args.method, pool), args.page)


if __name__ == "__main__":
    main()
