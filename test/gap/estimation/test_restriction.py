"""Unknowns held at the file's values. Truth: least squares without the columns of what is held, and drawn noise."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.restriction import (
    beside_file_derivatives,
    has_insignificant_cause,
    insignificant_sizes,
    restricted,
)


@pytest.fixture(scope="module")
def start(aircraft, plain_model) -> CandidateFit:
    """Scales of the IMU, of which nothing is off in the flight, where they start."""
    nuisances = nuisances_of(aircraft, plain_model)
    (scales,) = (c for c in candidates_of(plain_model.simulator, [plain_model]) if c.label == "imu_scale")
    return linearised(with_candidates(unfitted([plain_model], nuisances), [scales], nuisances, [0.0] * 6))


def _standing_at(start: CandidateFit, ratios: list[float]) -> CandidateFit:
    """The fit with sizes that are so many standard errors from the file, uncorrelated with one another."""
    count = len(ratios)
    information = start.information.copy()
    information[:count] = information[:, :count] = 0.0
    information[range(count), range(count)] = 1e4
    (flight,) = start.flights
    point = flight.point.copy()
    point[list(start.indices)] = np.array(ratios) / 100.0
    return replace(start, flights=(flight.at(point),), information=information)


@pytest.mark.parametrize(
    ("ratios", "held"),
    [
        ([5.0, 0.5, -1.9, 2.1, -8.0, 0.0], {1, 2, 5}),
        ([5.0, 3.0, -2.9, 2.1, -8.0, 4.0], set()),
        ([0.1, 0.2, -0.3, 0.4, -0.6, 0.5], {0, 1, 2, 3, 5}),  # the cause keeps its most significant size
    ],
)
def test_sizes_whose_intervals_hold_the_files_values_are_insignificant(start, ratios, held) -> None:
    fit = _standing_at(start, ratios)
    assert set(insignificant_sizes(fit, np.full(6, 0.01))) == {start.indices[k] for k in held}


def test_the_stated_standard_errors_decide(start) -> None:
    """A size that is 2.1 standard errors of the fit away is 1.4 of those that are stated."""
    fit = _standing_at(start, [5.0, 2.1, -2.9, 2.1, -8.0, 4.0])
    stated = np.array([0.01, 0.015, 0.01, 0.01, 0.01, 0.01])
    assert insignificant_sizes(fit, stated) == (fit.indices[1],)


@pytest.mark.parametrize(("largest", "none"), [(1.9, True), (2.0, False)])
def test_a_cause_is_insignificant_where_all_of_its_intervals_hold_the_files_values(start, largest, none) -> None:
    fit = _standing_at(start, [0.1, -largest, 0.4, 0.0, -0.6, 0.5])
    assert has_insignificant_cause(fit, np.full(6, 0.01)) is none
    assert has_insignificant_cause(fit, np.full(6, 0.02))


def test_of_two_sizes_that_stand_in_for_each_other_one_is_significant(start) -> None:
    """Each alone lies within its interval, because the other may be the reason; both do not."""
    fit = _standing_at(start, [9.0, 1.2, 1.5, 9.0, 9.0, 9.0])
    information = fit.information.copy()
    information[1, 2] = information[2, 1] = 0.95e4
    errors = np.sqrt(np.diag(np.linalg.inv(information)))[1:3]
    assert (fit.values[1:3] / errors < 1.96).all()
    unlike = replace(fit, information=information)
    errors = np.sqrt(np.diag(unlike.covariance))[:6]
    assert insignificant_sizes(unlike, errors) == (fit.indices[1],)
    assert not has_insignificant_cause(unlike, errors)


def _after_one_step(start: CandidateFit) -> CandidateFit:
    """The fit after one step of least squares, linearised where it started."""
    (flight,) = start.flights
    point, chosen, step = flight.point.copy(), list(start.indices), _least_squares(start, [])
    point[chosen] += step[: len(chosen)]
    point[list(flight.nuisances.indices)] += step[len(chosen) + flight.nuisances.places(0)]
    return start.at([point])


def _least_squares(start: CandidateFit, held: list[int]) -> np.ndarray:
    """The step (unknowns,) of least squares over all unknowns but those at the places that are held."""
    (flight,) = start.flights
    J, r = flight.slopes.reshape(-1, flight.slopes.shape[2]), flight.rows.ravel()
    free = np.setdiff1d(np.arange(J.shape[1]), held)
    step = np.zeros(J.shape[1])
    step[free] = np.linalg.solve(start.information[np.ix_(free, free)], (J.T @ r)[free])
    return step


def test_all_else_is_where_it_is_best_without_what_is_held(start) -> None:
    """One step of restricted least squares lands where least squares over the other unknowns does."""
    there = restricted(_after_one_step(start), start.indices[:3])
    scale = np.sqrt(np.diag(start.covariance))[:6]
    np.testing.assert_array_equal(there.values[:3], 0.0)
    np.testing.assert_allclose(there.values / scale, _least_squares(start, [0, 1, 2])[:6] / scale, atol=1e-6)
    np.testing.assert_array_equal(there.information, start.information)


def test_beside_the_files_derivatives_sizes_are_those_of_least_squares_without_derivatives(start) -> None:
    fitted = _after_one_step(start)
    there = beside_file_derivatives(fitted)
    places = len(start.indices) + np.array(start.derivative_places)
    scale = np.sqrt(np.diag(start.covariance))[:6]
    assert np.abs(fitted.stacked[0][fitted.derivative_places]).max() > 0.0
    np.testing.assert_allclose(there.stacked[0][there.derivative_places], 0.0, atol=1e-12)
    np.testing.assert_allclose(there.values / scale, _least_squares(start, places.tolist())[:6] / scale, atol=1e-6)
    assert np.abs((there.values - fitted.values) / scale).max() > 0.1


def test_derivatives_that_are_a_cause_stay_free(aircraft, plain_model) -> None:
    nuisances = nuisances_of(aircraft, plain_model)
    (cause,) = (c for c in candidates_of(plain_model.simulator, [plain_model]) if c.label == "derivative_error of Cm")
    fitted = _after_one_step(linearised(with_candidates(unfitted([plain_model], nuisances), [cause], nuisances, ())))
    there, neutral = beside_file_derivatives(fitted), plain_model.simulator.neutral()
    moved = there.flights[0].point[list(cause.widened)] - neutral[list(cause.widened)]
    assert np.abs(moved).max() > 0.0
    left = set(there.derivative_places) - {there.nuisances.indices.index(i) for i in cause.widened}
    np.testing.assert_allclose(there.stacked[0][sorted(left)], 0.0, atol=1e-12)
