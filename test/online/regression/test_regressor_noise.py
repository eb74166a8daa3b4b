"""Sensors' noise in the regressors: its expected energy, and the bias that its subtraction removes."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import TRUTH, exact_flight, fly, made_aircraft, multisteps

from sysid_node.aircraft.model import DEFAULT_NOISE, Aircraft
from sysid_node.online.frequency import fourier_transform, regression_signals
from sysid_node.online.regression import least_squares, normal_equations, regressor_noise
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings

Array = NDArray[np.float64]
NOISY = made_aircraft(noise={**DEFAULT_NOISE, "alpha": 0.02, "beta": 0.02})
SILENT = replace(NOISY, noise={**DEFAULT_NOISE, "alpha": 0.0, "beta": 0.0, "gyro": 0.0})
BOASTFUL = replace(NOISY, noise={**DEFAULT_NOISE, "alpha": 0.2, "beta": 0.2})
NAMES = ("CL_alpha", "Cm_alpha", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "CY_beta")


def signals_of(aircraft: Aircraft, time: Array, samples: Array) -> Array:
    """(N, T) signals of the samples."""
    rows, _ = regression_signals.array_signals(aircraft)([np.ascontiguousarray(column) for column in samples.T])
    rows.insert(regression_signals.OFFSET + 2, time)
    return np.stack(rows, axis=1)


def test_expected_energy_is_that_of_noisy_samples() -> None:
    """150 records of noise on flow angles and gyros against the closed form, per line and second."""
    layout, grid = regression_signals.layout(NOISY), fourier_transform.lines(0.1, 0.1, 2.0)
    rng, step, names = np.random.default_rng(0), 0.02, ("alpha", "beta", "p", "q", "r", "CL", "CD")
    time = np.arange(0.0, 10.0, step)
    level = np.tile(exact_flight(NOISY, np.array([0.0, 1.0]))[:1], (time.size, 1))
    level[:, 3:6] = 0.0
    clean, steps = signals_of(NOISY, time, level), np.diff(time)
    waves = np.array([fourier_transform.exact(grid, begin, end)[0, :-1] for begin, end in pairwise(time.tolist())])
    sigma = [NOISY.noise[sensor] for sensor in ("gyro", "gyro", "gyro", "alpha", "beta")]
    energy = np.zeros((layout.width, layout.width))
    for _ in range(150):
        samples = level.copy()
        samples[:, [3, 4, 5, 7, 8]] += rng.normal(size=(time.size, 5)) * sigma
        errors = signals_of(NOISY, time, samples) - clean
        areas = 0.5 * steps[:, None] * (errors[1:] + errors[:-1])
        lines = waves.T @ areas
        energy += lines.T @ lines
    per_line_second = energy / 150 / (grid.count * 10.0)
    expected = regressor_noise.gram_bias(NOISY, layout, clean.mean(axis=0), step, step)
    places = [layout.column(name) for name in names]
    found, expected = per_line_second[np.ix_(places, places)], expected[np.ix_(places, places)]
    scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    np.testing.assert_allclose(found / scale, expected / scale, atol=0.08)


def mean_errors(aircraft: Aircraft, method: str, time: Array, flights: Array) -> tuple[Array, Array]:
    """Mean relative error of each derivative over the flights, and the mean's standard deviation."""
    ends = [
        run(aircraft, OnlineSettings(method=method), time, samples, time[-1:])[0].derivatives for samples in flights
    ]
    errors = np.array([[found[name].value / TRUTH[name] - 1.0 for name in NAMES] for found in ends])
    return errors.mean(axis=0), errors.std(axis=0) / np.sqrt(len(errors))


@pytest.fixture(scope="module")
def noisy_flights() -> tuple[Array, Array]:
    """Eight flights in light turbulence, the autopilot's loop closed over noisy sensors; vanes of over a degree."""
    return fly(NOISY, multisteps(30.0, 100.0, amplitude=0.05), flights=8, seed=1, gusts=0.7)


@pytest.mark.slow
def test_noise_that_the_file_does_not_know_attenuates(noisy_flights: tuple[Array, Array]) -> None:
    """Errors in variables, Klein & Morelli (2006), sec. 5.3: what the compensation is there for."""
    time, flights = noisy_flights
    bias, spread = mean_errors(SILENT, "sls_rft", time, flights[:6])
    assert bias[NAMES.index("CL_alpha")] < -0.1
    assert bias[NAMES.index("Cm_de")] < -0.1
    assert (bias < -3.0 * spread).all()


@pytest.mark.slow
@pytest.mark.parametrize("method", ["sls_rft", "iv_rft"])
def test_known_noise_does_not_bias(method: str, noisy_flights: tuple[Array, Array]) -> None:
    bias, spread = mean_errors(NOISY, method, *noisy_flights)
    assert (np.abs(bias) < np.maximum(3.5 * spread, 0.02)).all(), bias


def test_no_more_noise_is_subtracted_than_the_residuals_show(noisy_flights: tuple[Array, Array]) -> None:
    """A file that claims ten times the vanes' noise: subtracted in full, it would be a hundred times the energy."""
    time, flights = noisy_flights
    bias, _ = mean_errors(BOASTFUL, "sls_rft", time, flights[:4])
    assert (np.abs(bias) < 0.1).all(), bias


def test_all_that_the_residual_holds_is_allowed() -> None:
    """One regressor with noise of energy b: the residual holds theta^2 b, beyond which the column's share shrinks."""
    layout = regression_signals.SignalLayout(("p",))
    equations = normal_equations.normal_equations({"Cl": ("p",)}, layout)
    bias = np.zeros((layout.width, layout.width))
    p = layout.column("p")
    bias[p, p] = 3.0
    solution = least_squares.Solution(np.array([[2.0]]), np.eye(1), np.ones(1), np.ones(1), True)
    np.testing.assert_allclose(regressor_noise.allowed(equations, solution, np.array([12.0]), bias), 1.0)
    share = regressor_noise.allowed(equations, solution, np.array([4.0]), bias)
    assert share[p] == pytest.approx(np.sqrt(4.0 / 12.0))
