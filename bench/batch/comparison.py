"""All methods on the same bundled flights: estimates against the truth, predictions of a held-out flight, cost.

Every method starts from the same wrong aircraft file: each derivative off by its tolerance times a random number, so
that no method profits from what the file already knows.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.pages import table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.identify import identify, predicted_coefficients
from sysid_node.batch.results.validation import figures_of_merit
from sysid_node.batch.settings import BatchSettings
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.record import FlightRecord
from sysid_node.flight.truth import read_truth
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]
BAGS = Path(__file__).resolve().parents[2] / "bags"

WATCHED = ("CL_alpha", "CL_de", "CD_alpha", "Cm_alpha", "Cm_q", "Cm_de", "CY_beta", "Cl_beta", "Cl_p", "Cl_da")
WATCHED = (*WATCHED, "Cn_beta", "Cn_r", "Cn_dr")

AIR_INTERVAL = 0.02  # s between air data in the bundled flights

#: Value, lower and upper end of the interval; NaN where not valid.
Found = Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Case:
    """A bundled flight with the data that every method is given."""

    aircraft: Aircraft
    record: FlightRecord
    truth: Mapping[str, float]


@cache
def case(name: str) -> Case:
    """The flight of a bag, with the wrong aircraft file."""
    aircraft = load_aircraft(name.partition("_")[0])
    rng = np.random.default_rng(1)
    wrong = {
        key: replace(d, value=d.value + (d.tolerance or 0.0) * float(rng.standard_normal()))
        for key, d in aircraft.derivatives.items()
    }
    record = replace(load_flight_record(BAGS / name, aircraft), name=name)
    return Case(replace(aircraft, derivatives=wrong), record, read_truth(BAGS / name))


def by_batch(method: str, flown: Case) -> Found:
    """The estimates of a method of ``sysid identify`` with its default settings."""
    fit = identify(method, flown.aircraft, [flown.record], BatchSettings()).fit
    return {n: (e.value, e.lower, e.upper) for n, e in fit.estimates.items() if e.valid and n in flown.truth}


def by_online(method: str, flown: Case) -> Found:
    """The online estimator's estimates at the end of the flight."""
    record = flown.record
    columns = {**record.columns, "air_interval": np.full(len(record), AIR_INTERVAL)}
    samples = np.column_stack([columns[name] for name in (*SAMPLE_COLUMNS, *flown.aircraft.control_symbols)])
    last = run(flown.aircraft, OnlineSettings(method=method), record.time, samples, record.time[-1:])[-1]
    return {n: (d.value, d.lower, d.upper) for n, d in last.derivatives.items() if d.valid}


METHODS: Mapping[str, Callable[[Case], Found]] = {
    "online, sls_rft": partial(by_online, "sls_rft"),
    "online, iv_rft": partial(by_online, "iv_rft"),
    **{
        name.replace("_", " "): partial(by_batch, name)
        for name in (
            "recursive_least_squares",
            "error_filtering",
            "constrained_least_squares",
            "equation_error",
            "frequency_equation_error",
            "neural_gauss_newton",
        )
    },
    **{
        f"{kind} Kalman filter": partial(by_batch, f"{kind}_kalman_filter")
        for kind in ("extended", "iterated", "unscented")
    },
    "output error": partial(by_batch, "output_error"),
    "filter error": partial(by_batch, "filter_error"),
}


def section(name: str, holdout: str, without: Sequence[str] = ()) -> str:
    """A table of errors on one flight, then one of predictions of another; ``without`` some methods."""
    flown, other = case(name), case(holdout)
    errors, responses = [], []
    for label, method in METHODS.items():
        if label in without:
            continue
        begin = time.process_time()
        found = method(flown)
        seconds = time.process_time() - begin
        errors.append([label, *_errors(found, flown.truth), f"{seconds:.1f}"])
        responses.append([label, *_predictions(found, other)])
        print("#", name, *errors[-1], flush=True)
    heads = ("error, %", *WATCHED, "mean", "intervals that hold", "processor, s")
    checked = (
        "",
        *(f"{c}: error" for c in ("CL", "CD", "CY", "Cl", "Cm", "Cn")),
        "Theil",
        "R^2",
        "white",
        "with inputs",
    )
    return f"{table(heads, errors)}\n\nOn {holdout}, held out:\n\n{table(checked, responses)}"


def _errors(found: Found, truth: Mapping[str, float]) -> list[str]:
    """Errors in % of the truth, their mean size, how many intervals of those valid hold it."""
    off = {n: 100.0 * (found[n][0] / truth[n] - 1.0) for n in WATCHED if n in found}
    holding = [lower <= truth[n] <= upper for n, (_, lower, upper) in found.items() if n in truth]
    mean = f"{np.mean(np.abs(list(off.values()))):.1f}" if off else "-"
    return [*(f"{off[n]:+.1f}" if n in off else "-" for n in WATCHED), mean, f"{sum(holding)} of {len(holding)}"]


def _predictions(found: Found, other: Case) -> list[str]:
    """Normalised error of each coefficient, then the means of the other figures; below the usual low-pass."""
    values = {n: value for n, (value, _, _) in found.items()}
    several = predicted_coefficients(other.aircraft, values, [other.record], BatchSettings().low_pass)
    if not several:
        return ["-"] * 10
    inputs = {s: np.interp(several[0].time, other.record.time, other.record[s]) for s in other.aircraft.control_symbols}
    merits = figures_of_merit(several[0], inputs)
    errors = [
        f"{merits[c]['normalised_error']:.3f}" if c in merits else "-" for c in ("CL", "CD", "CY", "Cl", "Cm", "Cn")
    ]
    means = [
        np.mean([m[key] for m in merits.values()]) for key in ("theil", "r_squared", "whiteness", "input_correlation")
    ]
    return [*errors, *(f"{mean:.3f}" for mean in means)]
