"""What one sample costs: the whole online estimator beside the bare arithmetic of its method, in one run.

    OMP_NUM_THREADS=1 python bench/update.py [--seconds 60] [--aircraft cdrw]

Every sample is taken in (kinematics, transform) and all derivatives are solved for with their variances; half-second
renewals (segments, colour of the residuals, watch for changes) fall in between. The bare arithmetic, 14 signals at 48
lines accumulated, their Gram matrix and two least-squares solves with covariances, is interleaved with it, so that both
meet the same machine.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.estimates import estimate, present
from sysid_node.online.settings import Settings
from sysid_node.online.state import State

Array = NDArray[np.float64]
RATE = 200.0  # Hz
SIGNALS, LINES = 14, 48
GROUPS = (
    ((0, 1, 2), (8, 9, 10)),
    ((3, 4, 5, 6, 7), (11, 12, 13)),
)  # regressors and outputs: 3 and 5, for 3 coefficients


def samples(aircraft: Aircraft, seconds: float) -> tuple[list[float], list[list[float]]]:
    """Times and aligned samples of noise about level flight: the cost does not depend on the values."""
    rng = np.random.default_rng(1)
    count, controls = round(seconds * RATE), len(aircraft.control_symbols)
    level = [
        0.3,
        0.0,
        -9.8,
        0.0,
        0.0,
        0.0,
        aircraft.reference.airspeed,
        0.08,
        0.0,
        1.2,
        5.0,
        1.0 / RATE,
        *[0.0] * controls,
    ]
    spread = [*[0.5] * 3, *[0.1] * 3, 0.3, 0.02, 0.02, 0.0, 0.1, 0.0, *[0.05] * controls]
    return (np.arange(count) / RATE).tolist(), (
        np.array(level) + spread * rng.normal(size=(count, len(level)))
    ).tolist()


def naive() -> Callable[[float, Array], Array]:
    """The bare arithmetic as one writes it down."""
    omega = 2.0 * np.pi * np.linspace(0.1, 1.98, LINES)
    state = {"X": np.zeros((LINES, SIGNALS), dtype=complex)}

    def step(t: float, x: Array) -> Array:
        state["X"] = state["X"] + np.outer(np.exp(-1j * omega * t), x) / RATE
        X = state["X"]
        gram = (X.conj().T @ X).real
        variances = []
        for regressors, outputs in GROUPS:
            normal = gram[np.ix_(regressors, regressors)] + 1e-9 * np.eye(len(regressors))
            right = gram[np.ix_(regressors, outputs)]
            theta = np.linalg.solve(normal, right)
            residual = np.diag(gram)[list(outputs)] - (theta * right).sum(axis=0)
            variances.append(np.outer(np.diag(np.linalg.inv(normal)), residual))
        return np.concatenate(variances)

    return step


def tuned() -> Callable[[float, Array], Array]:
    """The same with real and imaginary parts stacked, into memory that is kept."""
    phase = np.tile(2.0 * np.pi * np.linspace(0.1, 1.98, LINES), 2)
    shift = np.repeat([0.0, 0.5 * np.pi], LINES)
    X, term, wave = np.zeros((2 * LINES, SIGNALS)), np.empty((2 * LINES, SIGNALS)), np.empty(2 * LINES)
    column, gram = wave[:, None], np.empty((SIGNALS, SIGNALS))
    ridges = [1e-9 * np.eye(len(regressors)) for regressors, _ in GROUPS]
    blocks = [(gram[:3, :3], gram[:3, 8:11]), (gram[3:8, 3:8], gram[3:8, 11:14])]
    squares = [gram.diagonal()[8:11], gram.diagonal()[11:14]]

    def step(t: float, x: Array) -> Array:
        np.multiply(phase, t, out=wave)
        np.add(wave, shift, out=wave)
        np.cos(wave, out=wave)
        np.multiply(column, x, out=term)
        np.add(X, term, out=X)
        np.dot(X.T, X, out=gram)
        for (normal, right), ridge, square in zip(blocks, ridges, squares, strict=True):
            inverse = np.linalg.inv(normal + ridge)
            theta = inverse @ right
            residual = square - (theta * right).sum(axis=0)
            variance = inverse.diagonal()[:, None] * residual
        return variance

    return step


def timed(function: Callable[[], object]) -> float:
    """One call's time in us."""
    begin = time.perf_counter_ns()
    function()
    return (time.perf_counter_ns() - begin) / 1e3


def measure(aircraft: Aircraft, seconds: float) -> dict[str, Array]:
    """Times in us of every sample, by what was done."""
    state: State = estimator.init(aircraft, Settings())
    rng, bare = np.random.default_rng(2), {"naive NumPy": naive(), "tuned NumPy": tuned()}
    costs: dict[str, list[float]] = {name: [] for name in (*bare, "update", "present", "estimate")}
    for t, sample in zip(*samples(aircraft, seconds), strict=True):
        x = rng.normal(size=SIGNALS)
        for name, step in bare.items():
            costs[name].append(timed(lambda step=step, t=t, x=x: step(t, x)))
        costs["update"].append(timed(lambda t=t, sample=sample: estimator.update(state, t, sample)))
        costs["present"].append(timed(lambda: present(state)))
        costs["estimate"].append(timed(lambda: estimate(state)))
    found = {name: np.array(values[2 * int(RATE) :]) for name, values in costs.items()}
    return found | {"update + present": found["update"] + found["present"]}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Cost of one sample beside the bare arithmetic.")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--aircraft", default="cdrw")
    options = parser.parse_args()
    costs = measure(load_aircraft(options.aircraft), options.seconds)
    tuned_median = float(np.median(costs["tuned NumPy"]))
    print(f"{'us a sample':<18}{'median':>9}{'mean':>9}{'p99':>9}{'x tuned':>9}")
    for name, cost in costs.items():
        median = float(np.median(cost))
        print(
            f"{name:<18}{median:>9.1f}{cost.mean():>9.1f}{np.percentile(cost, 99):>9.1f}{median / tuned_median:>9.2f}"
        )


if __name__ == "__main__":
    main()
