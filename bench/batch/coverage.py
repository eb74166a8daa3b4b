"""Coverage of the batch estimators' intervals: hundreds of simulated flights, one after the other.

    python -m bench.batch.coverage [--flights 200] [--method M] [--air AIR] [--page docs/results/batch.md]

The cropped-delta UAV of the file cdrw, sensors at 100 Hz, closed loop: 3-2-1-1s on each surface, the autopilot holding
attitude, surfaces measured behind a lag of 0.04 s. Each flight has noise and turbulence of its own. The aircraft is
flown at the instruments' rate or faster: what surfaces do between the samples no estimator is told.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.estimation.judging import Verdict, exact, judge
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.batch.identify import identify
from sysid_node.batch.methods.maximum_likelihood_estimation import MaximumLikelihoodEstimation
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.settings import BatchSettings
from sysid_node.dynamics.atmosphere import air_density
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.record import FlightRecord
from sysid_node.sim import Simulator
from sysid_node.sim.flying.sortie import Sortie, SortieConditions, fly_sortie
from sysid_node.sim.model.layout import OUTPUTS

Array = NDArray[np.float64]

RATE = 100.0  # Hz, of the instruments, unless a trial says otherwise
SECONDS = 20.0
AIRCRAFT = exact(load_aircraft("cdrw"))
TRUTH = {name: derivative.value for name, derivative in AIRCRAFT.derivatives.items()}
MANOEUVRES = (
    "3211:elevator:amplitude=0.06:width=0.3:start=1:every=8:repeat=3",
    "3211:aileron:amplitude=0.06:width=0.25:start=4:every=8:repeat=2",
    "3211:rudder:amplitude=0.12:width=0.3:start=6:every=8:repeat=2",
)
#: For a model of the longitudinal motion alone, which takes the sideslip as measured, gusts and all.
ELEVATOR = ("3211:elevator:amplitude=0.06:width=0.3:start=1:every=6:repeat=3",)
WHOLE = BatchSettings(segment=0.0)
LONGITUDINAL = BatchSettings(segment=0.0, states=("V", "alpha", "q", "theta"))


@dataclass(frozen=True)
class Trial:
    """A method in some air; ``rotary``: whether the turbulence turns the air as well as moving it.

    ``faster``: how many times the instruments' ``rate`` (Hz) the aircraft is flown and its autopilot works at.
    """

    method: str
    air: str
    turbulence: str = "none"
    rotary: bool = True
    settings: BatchSettings = WHOLE
    faster: int = 1
    rate: float = RATE
    manoeuvres: Sequence[str] = MANOEUVRES


TRIALS = (
    Trial("equation_error", "still air"),
    Trial("frequency_equation_error", "still air"),
    Trial("output_error", "still air"),
    Trial("equation_error", "still air, flown at 200 Hz", faster=2),
    Trial("frequency_equation_error", "still air, flown at 200 Hz", faster=2),
    Trial("output_error", "still air, flown at 200 Hz", faster=2),
    Trial("filter_error", "light turbulence, elevator alone", "light", True, LONGITUDINAL, 1, 50.0, ELEVATOR),
    Trial("filter_error", "light turbulence, all surfaces", "light", True, LONGITUDINAL, 1, 50.0),
    Trial("filter_error", "light turbulence, all axes", "light", True, WHOLE, 1, 50.0),
    Trial("equation_error", "light turbulence", "light"),
    Trial("frequency_equation_error", "light turbulence", "light"),
)


@lru_cache
def _simulator(rate: float) -> Simulator:
    return Simulator(AIRCRAFT, rate)


def fly(seed: int, trial: Trial) -> FlightRecord:
    """One flight as aligned columns."""
    rate = trial.rate * trial.faster
    plan = parse_manoeuvre(trial.manoeuvres, AIRCRAFT, rate, SECONDS)
    deflections = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    effects = {"actuator_lag": {"time_constant": 0.04}}
    conditions = SortieConditions(effects, turbulence=trial.turbulence, seed=seed, rotary_gusts=trial.rotary)
    return _record(fly_sortie(_simulator(rate), deflections, conditions), f"flight {seed}", trial)


def _record(flown: Sortie, name: str, trial: Trial) -> FlightRecord:
    columns = dict(zip(OUTPUTS, np.asarray(flown.flight.outputs).T, strict=True))
    surfaces = (*AIRCRAFT.control_symbols, "thrust")
    columns |= dict(zip(surfaces, np.asarray(flown.flight.surfaces).T, strict=True))
    columns["rho"] = np.asarray(air_density(-np.asarray(flown.flight.states[:, 2]), np))
    measured = {key: values[:: trial.faster] for key, values in columns.items()}
    return FlightRecord(np.arange(len(measured["V"])) / trial.rate, measured, name)


def estimates(trial: Trial, flights: int) -> dict[str, Array]:
    """Value, standard error, lower, upper, valid (F, 5) of each derivative; a fit not converged is not valid."""
    several = [_rows(trial, fly(seed + 1, trial)) for seed in range(flights)]
    return {name: np.array([rows[name] for rows in several]) for name in TRUTH if name in several[0]}


def _rows(trial: Trial, record: FlightRecord) -> dict[str, list[float]]:
    if trial.method.endswith("equation_error"):
        fit = identify(trial.method, AIRCRAFT, [record], trial.settings).fit
    else:
        fit = _first(trial).on([record]).fit()
    return {name: _row(e, fit.search.converged) for name, e in fit.estimates.items() if name in TRUTH}


@lru_cache
def _first(trial: Trial) -> MaximumLikelihoodEstimation:
    """The method set up, so that it compiles only once."""
    return MaximumLikelihoodEstimation.of(trial.method, AIRCRAFT, [fly(1, trial)], trial.settings)


def _row(e: ParameterEstimate, converged: bool) -> list[float]:
    return [e.value, e.standard_error, e.lower, e.upper, float(e.valid and converged)]


HEADS = ("method", "air", "flights", "derivatives", "valid", "coverage %: min", "mean", "max", "outside")
HEADS = (*HEADS, "bias / s.e.", "s.e. / scatter", "> 4 s.e. %")


def section(trials: Sequence[Trial], flights: int, results: Path | None = None) -> str:
    """The table, a line a trial; ``results`` is a CSV file that keeps lines, and gives those it has."""
    kept = list(csv.reader(results.open(newline="", encoding="utf-8"))) if results and results.exists() else []
    rows = {(row[0], row[1]): row for row in kept}
    for trial in trials:
        if (trial.method, trial.air) in rows:
            continue
        verdicts = {n: judge(e, TRUTH[n]) for n, e in estimates(trial, flights).items()}
        rows[trial.method, trial.air] = _line(trial, flights, verdicts)
        if results:
            with results.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows(rows.values())
    order = [(trial.method, trial.air) for trial in TRIALS]
    chosen = [rows[key] for key in order if key in rows]
    return f"Flights of {SECONDS:g} s.\n\n{table(HEADS, chosen)}"


def _line(trial: Trial, flights: int, verdicts: dict[str, Verdict]) -> list[str]:
    known = {name: v for name, v in verdicts.items() if v.valid > 1}
    covered = {name: 100 * v.coverage for name, v in known.items()}
    worst, biased = min(covered, key=covered.__getitem__), max(known, key=lambda n: abs(known[n].bias))
    spread = [v.spread for v in known.values()]
    return [
        trial.method,
        trial.air,
        str(flights),
        str(len(verdicts)),
        f"{100 * np.mean([v.share_valid for v in verdicts.values()]):.0f} %",
        f"{covered[worst]:.1f} ({worst})",
        f"{np.mean(list(covered.values())):.1f}",
        f"{max(covered.values()):.1f}",
        f"{sum(v.off for v in known.values())} of {len(known)}",
        f"{known[biased].bias:+.2f} ({biased})",
        f"{min(spread):.2f} to {max(spread):.2f}",
        f"{100 * sum(v.far for v in known.values()) / sum(v.valid for v in known.values()):.2f}",
    ]


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=200, help="simulated flights a line (default: 200)")
    parser.add_argument("--method", help="this method only")
    parser.add_argument("--air", help="in this air only, as the table calls it")
    parser.add_argument("--results", type=Path, help="CSV file that keeps finished lines")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    wanted = {args.method, args.air} - {None}
    trials = [trial for trial in TRIALS if wanted <= {trial.method, trial.air}]
    publish("bench/batch/coverage.py", section(trials, args.flights, args.results), args.page)


if __name__ == "__main__":
    main()
