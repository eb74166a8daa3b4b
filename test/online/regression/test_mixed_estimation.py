"""Beliefs weighed with the flight: the product of two normal densities."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plant import TRUTH, exact_flight, made_aircraft

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Derivative
from sysid_node.flight.bag.reader import read_streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.regression.mixed_estimation import believed_derivatives, gained, weighed
from sysid_node.online.regression.normal_equations import model_structure
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings

ROOT = Path(__file__).resolve().parents[3]
AIRCRAFT = made_aircraft()
STRUCTURE = model_structure(AIRCRAFT.model_structure)


def test_beliefs_are_the_file_s() -> None:
    aircraft = replace(AIRCRAFT, derivatives={**AIRCRAFT.derivatives, "CL_q": Derivative(3.0)})
    values, precisions = believed_derivatives(aircraft, STRUCTURE)
    c = STRUCTURE.coefficients.index("CL")
    named = {STRUCTURE.regressors[i]: (values[i, c], precisions[i, c]) for i in STRUCTURE.unknowns(c)}
    assert named["alpha"] == (TRUTH["CL_alpha"], pytest.approx((0.1 * TRUTH["CL_alpha"]) ** -2))
    assert named["q"] == (3.0, 0.0)


def test_the_mean_is_that_of_mixed_estimation() -> None:
    """Klein & Morelli (2006), sec. 5.4: (P^-1 + D^-1)^-1 (P^-1 theta + D^-1 believed)."""
    rng = np.random.default_rng(0)
    values, precisions = believed_derivatives(AIRCRAFT, STRUCTURE)
    theta = (values + 0.3 * rng.normal(size=values.shape)) * STRUCTURE.belongs
    covariance = np.zeros((theta.shape[1], *STRUCTURE.same_block.shape))
    for c in range(theta.shape[1]):
        root = rng.normal(size=STRUCTURE.same_block.shape)
        covariance[c] = root @ root.T * np.outer(STRUCTURE.belongs[:, c], STRUCTURE.belongs[:, c])
    mean, spread = weighed(STRUCTURE, theta, covariance, values, precisions)
    for c in range(theta.shape[1]):
        unknowns = STRUCTURE.unknowns(c)
        P, D = np.linalg.inv(covariance[c][np.ix_(unknowns, unknowns)]), np.diag(precisions[unknowns, c])
        expected = np.linalg.inv(P + D)
        np.testing.assert_allclose(spread[c][np.ix_(unknowns, unknowns)], expected, rtol=1e-7)
        np.testing.assert_allclose(
            mean[unknowns, c], expected @ (P @ theta[unknowns, c] + D @ values[unknowns, c]), rtol=1e-7
        )


def test_without_tolerances_nothing_changes() -> None:
    values, precisions = believed_derivatives(AIRCRAFT, STRUCTURE)
    theta, covariance = values + 1.0, np.tile(STRUCTURE.same_block, (values.shape[1], 1, 1))
    mean, spread = weighed(STRUCTURE, theta, covariance, values, 0.0 * precisions)
    for c in range(theta.shape[1]):
        unknowns = STRUCTURE.unknowns(c)
        np.testing.assert_allclose(mean[unknowns, c], theta[unknowns, c])
        np.testing.assert_allclose(spread[c][np.ix_(unknowns, unknowns)], covariance[c][np.ix_(unknowns, unknowns)])


def test_a_flight_that_shows_little_leaves_the_beliefs() -> None:
    """Four seconds: no interval is wider than the file's tolerance, no estimate far from what is believed."""
    time = np.arange(0.0, 4.0, 0.01)
    samples = exact_flight(AIRCRAFT, time)
    samples[:, :9] += 0.02 * np.random.default_rng(1).normal(size=(time.size, 9)) * np.abs(samples[:, :9]).mean(axis=0)
    plain, informed = (
        run(AIRCRAFT, OnlineSettings(method="sls_rft", use_prior=use), time, samples, time[-1:])[0].derivatives
        for use in (False, True)
    )
    for name, belief in AIRCRAFT.derivatives.items():
        if name.endswith("_0"):
            continue
        assert belief.tolerance is not None
        assert informed[name].standard_error <= min(plain[name].standard_error * 1.5, belief.tolerance) + 1e-12, name
        assert abs(informed[name].value - belief.value) < 4.0 * belief.tolerance


def test_a_gain_that_rounding_made_singular_leaves_finite_numbers() -> None:
    """Two unknowns of which a flight tells the sum alone: (I + covariance / tolerance^2) loses its identity."""
    covariance = 1e20 * np.array([[[1.0, -1.0], [-1.0, 1.0]]])
    gain = covariance + np.eye(2)
    assert np.linalg.matrix_rank(gain[0]) == 1
    assert np.abs(gained(gain, covariance)).max() < 2.0


def test_exact_beliefs_stand_whatever_else_is_corrected() -> None:
    """The bundled flight, whose clocks and instruments are corrected for. Truth: the values it was flown with."""
    aircraft = load_aircraft("cdrw")
    exact = {name: replace(d, tolerance=1e-6 * abs(d.value) + 1e-9) for name, d in aircraft.derivatives.items()}
    known = replace(aircraft, derivatives=exact)
    flight = align_streams(known, read_streams(ROOT / "bags" / "cdrw_multistep"), 0.2)
    time, samples = flight.time[:4000], flight.samples[:4000]
    found = run(known, OnlineSettings(use_prior=True), time, samples, time[-1:])[0].derivatives
    moved = run(aircraft, OnlineSettings(), time, samples, time[-1:])[0].derivatives
    slopes = [name for name in exact if not name.endswith("_0")]
    for name in slopes:
        assert found[name].value == pytest.approx(exact[name].value, rel=1e-3), name
        assert found[name].lower < exact[name].value < found[name].upper, name
    assert max(abs(moved[name].value / exact[name].value - 1.0) for name in slopes) > 0.02
