"""Whether the online estimator's intervals hold the truth, by Monte Carlo.

    python -m bench.estimation.coverage

The cropped-delta UAV of the file cdrw, IMU at 200 Hz, air data at 100 Hz, in still air and in Dryden turbulence, each
flight with noise and turbulence of its own. Closed loop: 3-2-1-1s, the autopilot holding attitude; otherwise doublets.
Estimates after 5, 15 and 60 s are compared with the truth, among those marked valid. `--method` compares estimators.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from bench.estimation.judging import METHODS, Verdict, judge, many, processes
from bench.estimation.simulated_flights import Setting
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.settings import OnlineSettings

AIRCRAFT = "cdrw"
TIMES = np.array([5.01, 15.01, 59.99])  # s
SETTINGS = (
    Setting("white noise", autopilot=False),
    Setting("light turbulence", "light", autopilot=False),
    Setting("moderate turbulence", "moderate", autopilot=False),
    Setting("white noise, closed loop", "none"),
    Setting("light, closed loop", "light"),
    Setting("moderate, closed loop", "moderate"),
    Setting("moderate, closed loop, air not turning", "moderate", rotary=False),
)
#: Where plain least squares is biased, and what the others take from it.
HARD = (
    Setting("white noise"),
    Setting("white noise, vanes 3 x as noisy", vane_noise=3.0),
    Setting("light turbulence", "light"),
    Setting("moderate turbulence", "moderate"),
    Setting("moderate, vanes 3 x as noisy", "moderate", vane_noise=3.0),
)
TRUTH = {name: d.value for name, d in load_aircraft(AIRCRAFT).derivatives.items()}
Verdicts = Mapping[tuple[str, float], Sequence[Verdict]]  # by setting and time, in the file's order


def cover(flights: int, settings: Sequence[Setting], method: str, pool: ProcessPoolExecutor) -> str:
    """The tables of one method over the settings."""
    verdicts = {}
    for setting in settings:
        estimated = many(AIRCRAFT, setting, [METHODS[method]], TIMES, flights, pool)[0]
        for k, time in enumerate(TIMES):
            columns = enumerate(TRUTH.values())
            verdicts[setting.name, time] = [judge(estimated[:, k, d], truth) for d, truth in columns]
    return f"{_summary(verdicts)}\n\nCoverage of each derivative, %:\n\n{_matrix(verdicts)}"


def _summary(verdicts: Verdicts) -> str:
    heads = (
        "setting",
        "s",
        "valid",
        "coverage %: min",
        "mean",
        "max",
        "+-",
        "outside",
        "bias / s.e.",
        "s.e. / scatter",
    )
    return table((*heads, "> 4 s.e. %"), (_row(*key, several) for key, several in verdicts.items()))


def _row(setting: str, time: float, several: Sequence[Verdict]) -> list[str]:
    """One setting at one time."""
    known = [v for v in several if v.valid > 1]
    valid = f"{100 * np.mean([v.share_valid for v in several]):.0f} %"
    if not known:
        return [setting, f"{time:g}", valid, *["-"] * 8]
    covered, spread = [100 * v.coverage for v in known], [v.spread for v in known]
    names = [name for name, v in zip(TRUTH, several, strict=True) if v.valid > 1]
    worst = max(range(len(known)), key=lambda i: abs(known[i].bias))
    far = sum(v.far for v in known) / sum(v.valid for v in known)
    return [
        setting,
        f"{time:g}",
        valid,
        f"{min(covered):.1f} ({names[int(np.argmin(covered))]})",
        f"{np.mean(covered):.1f}",
        f"{max(covered):.1f}",
        f"{100 * max(v.doubt for v in known):.1f}",
        f"{sum(v.off for v in known)} of {len(known)}",
        f"{known[worst].bias:+.2f} ({names[worst]})",
        f"{min(spread):.2f} to {max(spread):.2f}",
        f"{100 * far:.2f}",
    ]


def _matrix(verdicts: Verdicts) -> str:
    """Coverage by derivative (rows), setting and time (columns)."""
    heads = ["", *(f"{setting}, {time:g} s" for setting, time in verdicts)]
    cells = [[_covered(v) for v in several] for several in verdicts.values()]
    return table(heads, ([name, *row] for name, row in zip(TRUTH, zip(*cells, strict=True), strict=True)))


def _covered(v: Verdict) -> str:
    return "-" if math.isnan(v.coverage) else f"{100 * v.coverage:.0f}{'!' if v.off else ''}"


def compare(flights: int, pool: ProcessPoolExecutor) -> str:
    """What each method leaves of the bias, after 60 s."""
    rows = []
    for setting in HARD:
        estimated = many(AIRCRAFT, setting, list(METHODS.values()), TIMES[-1:], flights, pool)[:, :, 0]
        for method, several in zip(METHODS.values(), estimated, strict=True):
            verdicts = {name: judge(several[:, d], truth) for d, (name, truth) in enumerate(TRUTH.items())}
            rows.append([setting.name, method.name, *_biases(verdicts)])
    heads = ("setting", "method", *(f"{name}, %" for name in WATCHED), "coverage %: min", "mean", "> 4 s.e. %")
    return table(heads, rows)


WATCHED = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "CY_beta", "Cl_beta", "Cl_p", "Cn_beta", "Cn_r")


def _biases(verdicts: Mapping[str, Verdict]) -> list[str]:
    """Mean errors in % of the truth, then coverage and confident wrong ones over all derivatives."""
    known = [v for v in verdicts.values() if v.valid > 1]
    shares = [100 * (verdicts[name].mean / TRUTH[name] - 1) for name in WATCHED]
    errors = ["-" if math.isnan(share) else f"{share:+.1f}" for share in shares]
    covered = [100 * v.coverage for v in known]
    far = 100 * sum(v.far for v in known) / sum(v.valid for v in known)
    return [*errors, f"{min(covered):.0f}", f"{np.mean(covered):.1f}", f"{far:.2f}"]


def main() -> None:
    """Print the tables, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=200, help="a setting (default: 200)")
    parser.add_argument("--quick", action="store_true", help="60 flights a setting")
    parser.add_argument("--setting", choices=[s.name for s in SETTINGS], help="only this one")
    parser.add_argument("--method", choices=[*METHODS, "compare"], default=OnlineSettings().method)
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    flights = 60 if args.quick else args.flights
    with processes() as pool:
        if args.method == "compare":
            publish("bench/estimation/coverage.py --method compare", compare(flights, pool), args.page)
        else:
            chosen = [s for s in SETTINGS if args.setting in (None, s.name)]
            publish("bench/estimation/coverage.py", cover(flights, chosen, args.method, pool), args.page)


if __name__ == "__main__":
    main()
