"""Noise that comes with the motion: against White's heteroskedastic covariance and against scatter."""

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import made_aircraft

from sysid_node.online.frequency.regression_signals import SignalLayout, layout
from sysid_node.online.regression import heteroskedasticity, normal_equations
from sysid_node.online.regression.heteroskedasticity import NoiseMoments

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft()
STEP = 0.01  # s


def bursts(seed: int, samples: int = 400) -> tuple[SignalLayout, normal_equations.NormalEquations, Array]:
    """A roll motion of a few short bursts, as rows of signals."""
    equations = normal_equations.normal_equations({"Cl": ("p", "da")}, layout := signals())
    rows = np.zeros((samples, layout.transformed))
    rng = np.random.default_rng(seed)
    envelope = (np.arange(samples) % 100 < 15).astype(float)
    for column in equations.columns:
        rows[:, column] = envelope * rng.normal(size=samples)
    return layout, equations, rows


def signals() -> SignalLayout:
    """The layout of all signals."""
    return layout(AIRCRAFT, ())


def measured(theta: Array, seed: int = 0, boxes: int = 400) -> tuple[NoiseMoments, Array, Array]:
    """The unevenness of noise in the airspeed, the regressors (N, P), and the noise's density (N,)."""
    layout, equations, rows = bursts(seed)
    mean, duration = np.zeros(rows.shape[1]), STEP * len(rows)
    found = heteroskedasticity.measure(AIRCRAFT, layout, equations, theta, rows, mean, duration, STEP, boxes)
    x = rows[:, equations.columns]
    relative = 2.0 * AIRCRAFT.noise["airspeed"] / AIRCRAFT.reference.airspeed
    return found, x, STEP * (relative * (x @ theta[:, 0])) ** 2


def test_with_the_mean_density_it_is_whites_covariance() -> None:
    theta = np.array([[-0.4], [0.2]])
    found, x, w = measured(theta)
    even = STEP * x.T @ x
    extra = heteroskedasticity.heteroskedastic_excess(found, even, np.ones((2, 2)), np.array([w.mean()]))
    np.testing.assert_allclose(w.mean() * even + extra[0], STEP * (w[:, None] * x).T @ x, rtol=1e-6)


def test_bursts_make_errors_larger_than_even_noise_would() -> None:
    """Scatter of least squares on signals that a noisy airspeed has scaled, over 2000 draws."""
    theta = np.array([[-0.4], [0.2]])
    found, x, w = measured(theta)
    inverse = np.linalg.inv(x.T @ x)
    extra = heteroskedasticity.heteroskedastic_excess(found, STEP * x.T @ x, np.ones((2, 2)), np.array([w.mean()]))[0]
    claimed = inverse @ (w.mean() * STEP * x.T @ x + extra) @ inverse / STEP**2
    rng = np.random.default_rng(3)
    noise = np.sqrt(w / STEP) * rng.normal(size=(2000, len(x)))
    errors = noise @ x @ inverse
    scatter = errors.var(axis=0)
    np.testing.assert_allclose(claimed.diagonal(), scatter, rtol=0.12)
    assert (scatter > 2.0 * (w.mean() / STEP * inverse).diagonal()).all()


def test_stationary_noise_has_no_excess() -> None:
    x = np.random.default_rng(1).normal(size=(300, 2))
    moments = x.T @ x
    even = NoiseMoments(0.7 * moments[None], np.array([0.7 * 3.0]), moments, duration=3.0)
    extra = heteroskedasticity.heteroskedastic_excess(even, 5.0 * moments, np.ones((2, 2)), np.array([1.0]))
    np.testing.assert_allclose(extra, 0.0, atol=1e-9)


def test_no_more_than_the_residual_comes_and_goes() -> None:
    found, x, w = measured(np.array([[-0.4], [0.2]]))
    even = STEP * x.T @ x
    whole, half = (
        heteroskedasticity.heteroskedastic_excess(found, even, np.ones((2, 2)), np.array([s * w.mean()]))
        for s in (1.0, 0.5)
    )
    np.testing.assert_allclose(half, 0.5 * whole)


def test_nothing_measured_adds_nothing() -> None:
    assert heteroskedasticity.heteroskedastic_excess(NoiseMoments(), np.eye(2), np.ones((2, 2)), np.ones(1)) == 0.0


def test_sums_and_scales() -> None:
    found = measured(np.array([[-0.4], [0.2]]))[0]
    twice = found + found * 1.0
    assert twice.duration == pytest.approx(2.0 * found.duration)
    np.testing.assert_allclose(twice.weighted, 2.0 * found.weighted)


def test_what_is_left_of_the_drag_comes_with_the_lift() -> None:
    """Beyond the sensors' noise, a residual is shaped as the lift's square; within it, by the vane's noise alone."""
    moments = np.eye(1)
    noise_moments = NoiseMoments(
        np.zeros((1, 1, 1)), np.zeros(1), moments, 2.0 * moments[None], np.ones(1), np.ones(1), 1.0
    )
    calm, rough = (
        heteroskedasticity.heteroskedastic_excess(noise_moments, moments, np.ones((1, 1)), np.array([s]))
        for s in (2.0, 8.0)
    )
    assert calm == pytest.approx(np.array([[[1.0]]]))  # w x x' less the mean w
    assert rough == pytest.approx(np.array([[[8.0 - 1.5]]]))
