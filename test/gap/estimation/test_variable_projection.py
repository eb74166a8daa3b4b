"""Nuisances eliminated by linear algebra; truth: least squares in all unknowns at once, and finite differences."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import Candidate, candidates_of
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.variable_projection import VariableProjection


@pytest.fixture(scope="module")
def scale_error(plain_model) -> Candidate:
    (candidate,) = (c for c in candidates_of(plain_model.simulator, [plain_model]) if c.effect == "mass_error")
    return candidate


@pytest.fixture(scope="module")
def start(aircraft, plain_model, scale_error) -> CandidateFit:
    """A mass error of 1 %, so small that no nuisance parameter reaches its limit."""
    nuisances = nuisances_of(aircraft, plain_model)
    free = replace(nuisances, limit=1e3 * nuisances.limit)
    return with_candidates(unfitted([plain_model], free), [scale_error], free, [0.01])


def test_what_is_left_is_the_least_that_nuisances_can_leave(start) -> None:
    fit = linearised(start)
    (flight,) = fit.flights
    chosen = len(fit.indices)
    slopes = flight.slopes.reshape(-1, flight.slopes.shape[2])[:, chosen:]
    order = np.argsort(fit.nuisances.places(0))
    sigma = fit.nuisances.sigma[order]
    matrix = np.vstack([slopes * sigma, np.eye(sigma.size)])
    rows = np.append(flight.rows.ravel(), np.zeros(sigma.size))
    truth = rows - matrix @ np.linalg.lstsq(matrix, rows, rcond=None)[0]
    found = VariableProjection(start).residual(start.values)
    assert np.sum(found[:-1] ** 2) == pytest.approx(np.sum(truth**2), rel=1e-8)


def test_the_last_row_is_the_parameters_own_prior(start) -> None:
    problem = VariableProjection(start)
    assert problem.residual(start.values)[-1] == pytest.approx(0.01 / problem.sigma[0])


def test_kaufmans_slopes_are_those_of_what_is_left(start) -> None:
    """They leave out how the nuisances' own slopes change, which small residuals make small."""
    problem, step = VariableProjection(start), 1e-5
    numeric = (problem.residual(start.values + step) - problem.residual(start.values - step)) / (2.0 * step)
    found = problem.jacobian(start.values)[:, 0]
    assert np.linalg.norm(found - numeric) < 1e-3 * np.linalg.norm(numeric)


def test_points_hold_the_values_and_the_nuisances_at_their_best(start) -> None:
    """Truth: about there, nothing is left to gain."""
    point = VariableProjection(start).points(start.values)
    best = linearised(start.at(point))
    np.testing.assert_array_equal(best.values, start.values)
    (flight,) = best.flights
    now, sigma, _ = best.stacked
    slopes = flight.slopes.reshape(-1, flight.slopes.shape[2])[:, len(best.indices) :]
    gradient = slopes.T @ flight.rows.ravel() - now / sigma**2
    worth = gradient**2 / (np.sum(slopes**2, axis=0) + sigma**-2.0)  # in units of the deviance
    assert worth.max() < 1.0


def test_a_candidate_that_is_added_moves_with_the_others(aircraft, plain_model, scale_error) -> None:
    nuisances = nuisances_of(aircraft, plain_model)
    problem = VariableProjection(unfitted([plain_model], nuisances))
    other = problem.with_candidate(scale_error)
    assert other.indices == list(scale_error.indices) and problem.indices == []
    value = np.array([0.01])
    whole = VariableProjection(with_candidates(unfitted([plain_model], nuisances), [scale_error], nuisances, value))
    assert other.deviance(value) == pytest.approx(whole.deviance(value), rel=1e-3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e200, np.inf, np.nan])
def test_a_divergent_prediction_has_no_finite_deviance(start, size: float) -> None:
    problem = VariableProjection(start)
    assert np.isfinite(problem.deviance(start.values))
    assert problem.deviance(np.full_like(start.values, size)) == np.inf
