"""What one sample costs: the whole online estimator beside the bare arithmetic of its method, in one run.

    OMP_NUM_THREADS=1 python -m bench.speed.update [--bag bags/cdrw_multistep] [--aircraft cdrw] [--repeat 3] \
        [--page docs/results/cost.md]

Every sample of the flight is taken in (kinematics, transform), all derivatives are solved for with their variances, and
each is judged; renewals (segments, colour of the residuals, watch for changes) fall in between, every second or so.
``estimate`` solves and judges too, and adds intervals and names, as published. The bare arithmetic is 14 signals at 48
lines accumulated, their Gram matrix and two least-squares solves with covariances. Both are timed by turns, a hundred
samples at a time.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.bag.reader import read_streams
from sysid_node.online import estimator
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.estimates.current_solution import current_solution
from sysid_node.online.estimates.published import estimate
from sysid_node.online.estimates.validity import judge
from sysid_node.online.settings import METHODS, OnlineSettings
from sysid_node.online.state import EstimatorState

Array = NDArray[np.float64]
Bare = Callable[[float, Array], object]
SIGNALS, LINES, STEP = 14, 48, 0.005
GROUPS = ((slice(0, 3), slice(8, 11)), (slice(3, 8), slice(11, 14)))  # 3 and 5 regressors, 3 coefficients each
TURN = 100  # samples
WARM = 1000  # samples left out


def naive() -> Bare:
    """The bare arithmetic as one writes it down."""
    omega = 2.0 * np.pi * np.linspace(0.1, 1.98, LINES)
    state = {"X": np.zeros((LINES, SIGNALS), dtype=complex)}

    def step(t: float, x: Array) -> object:
        state["X"] = state["X"] + np.outer(np.exp(-1j * omega * t), x) * STEP
        gram = (state["X"].conj().T @ state["X"]).real
        found = []
        for regressors, outputs in GROUPS:
            normal, right = gram[regressors, regressors] + 1e-9 * np.eye(size_of(regressors)), gram[regressors, outputs]
            theta = np.linalg.solve(normal, right)
            residual = np.diag(gram)[outputs] - (theta * right).sum(axis=0)
            found.append((theta, np.outer(np.diag(np.linalg.inv(normal)), residual)))
        return found

    return step


def size_of(part: slice) -> int:
    """Number of entries of a slice."""
    return int(part.stop - part.start)


def tuned() -> Bare:
    """The same with real and imaginary parts stacked, into memory that is kept, and one inverse for both uses."""
    phase = np.tile(2.0 * np.pi * np.linspace(0.1, 1.98, LINES), 2)
    shift = np.repeat([0.0, 0.5 * np.pi], LINES)
    X, term, wave = np.zeros((2 * LINES, SIGNALS)), np.empty((2 * LINES, SIGNALS)), np.empty(2 * LINES)
    column, gram = wave[:, None], np.empty((SIGNALS, SIGNALS))
    groups = [
        (
            gram[regressors, regressors],
            gram[regressors, outputs],
            gram.diagonal()[outputs],
            1e-9 * np.eye(size_of(regressors)),
        )
        for regressors, outputs in GROUPS
    ]

    def step(t: float, x: Array) -> object:
        np.multiply(phase, t, out=wave)
        np.add(wave, shift, out=wave)
        np.cos(wave, out=wave)
        np.dot(column, x[None], out=term)
        np.add(X, term, out=X)
        np.dot(X.T, X, out=gram)
        found = []
        for normal, right, square, ridge in groups:
            inverse = np.linalg.inv(normal + ridge)
            theta = np.dot(inverse, right)
            residual = square - (theta * right).sum(axis=0)
            found.append((theta, inverse.diagonal()[:, None] * residual))
        return found

    return step


def timed(work: Callable[[], object]) -> float:
    """One call's time in us."""
    begin = time.perf_counter_ns()
    work()
    return (time.perf_counter_ns() - begin) / 1e3


def step_by_step(state: EstimatorState, moment: float, sample: list[float]) -> tuple[float, float, float]:
    """What taking in one sample, solving, and judging take, us."""
    begin = time.perf_counter_ns()
    estimator.update(state, moment, sample)
    updated = time.perf_counter_ns()
    current, latest = current_solution(state), state.latest
    solved = time.perf_counter_ns()
    if current is not None and latest is not None:
        judge(state, latest, current, moment)
    judged = time.perf_counter_ns()
    return (updated - begin) / 1e3, (solved - updated) / 1e3, (judged - solved) / 1e3


def measure(aircraft: Aircraft, bag: Path, method: str) -> dict[str, Array]:
    """Times in us of every sample, by what was done."""
    settings = OnlineSettings(method=method)
    aligned = align_streams(aircraft, read_streams(bag), settings.max_gap)
    state = estimator.init(aircraft, settings)
    bare, x = {"naive NumPy": naive(), "tuned NumPy": tuned()}, np.random.default_rng(1).normal(size=(TURN, SIGNALS))
    costs: dict[str, list[float]] = {name: [] for name in (*bare, "update", "present", "judge", "estimate")}
    times, samples = aligned.time.tolist(), aligned.samples.tolist()
    for first in range(0, len(times), TURN):
        turn = range(first, min(first + TURN, len(times)))
        for name, step in bare.items():
            costs[name] += [timed(lambda i=i, step=step: step(times[i], x[i - first])) for i in turn]  # noqa: B023
        parts = zip(*(step_by_step(state, times[i], samples[i]) for i in turn), strict=True)
        for name, part in zip(("update", "present", "judge"), parts, strict=True):
            costs[name] += part
        costs["estimate"] += [timed(lambda: estimate(state)) for _ in turn]
    found = {name: np.array(values[WARM:]) for name, values in costs.items()}
    return {
        **found,
        "update, present": found["update"] + found["present"],
        "update, present, judge": found["update"] + found["present"] + found["judge"],
        "update, estimate": found["update"] + found["estimate"],
    }


def measured(method: str, aircraft: Aircraft, bag: Path, repeat: int) -> str:
    """The table of one method, of the fastest of so many runs."""
    runs = [measure(aircraft, bag, method) for _ in range(repeat)]
    costs = min(runs, key=lambda run: float(np.median(run["tuned NumPy"])))
    reference = float(np.median(costs["tuned NumPy"]))
    rows = []
    for name, cost in costs.items():
        median, p99 = np.percentile(cost, [50.0, 99.0])
        rows.append([name, f"{median:.1f}", f"{cost.mean():.1f}", f"{p99:.1f}", f"{median / reference:.2f}"])
    return table((f"{method}: us a sample", "median", "mean", "p99", "x tuned"), rows)


def main() -> None:
    """Print a table for each method, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bag", type=Path, default=Path("bags/cdrw_multistep"))
    parser.add_argument("--aircraft", default="cdrw")
    parser.add_argument("--repeat", type=int, default=3, help="of which the fastest counts")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    options = parser.parse_args()
    aircraft = load_aircraft(options.aircraft)
    tables = [measured(method, aircraft, options.bag, options.repeat) for method in METHODS]
    publish("bench/speed/update.py", "\n\n".join(tables), options.page)


if __name__ == "__main__":
    main()
