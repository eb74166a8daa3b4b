"""Sizes held at the file's values. Truth: least squares without the columns of what is held, and drawn noise."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.estimation.restriction import insignificant_sizes, restricted


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


def test_of_two_sizes_that_stand_in_for_each_other_one_is_significant(start) -> None:
    """Each alone lies within its interval, because the other may be the reason; both do not."""
    fit = _standing_at(start, [9.0, 1.2, 1.5, 9.0, 9.0, 9.0])
    information = fit.information.copy()
    information[1, 2] = information[2, 1] = 0.95e4
    errors = np.sqrt(np.diag(np.linalg.inv(information)))[1:3]
    assert (fit.values[1:3] / errors < 1.96).all()
    unlike = replace(fit, information=information)
    assert insignificant_sizes(unlike, np.sqrt(np.diag(unlike.covariance))[:6]) == (fit.indices[1],)


def test_all_else_is_where_it_is_best_without_what_is_held(start) -> None:
    """One step of restricted least squares lands where least squares over the other unknowns does."""
    fit = replace(start, information=start.information)
    (flight,) = fit.flights
    J, r = flight.slopes.reshape(-1, flight.slopes.shape[2]), flight.rows.ravel()
    whole = np.linalg.solve(fit.information, J.T @ r)
    point = flight.point.copy()
    chosen = list(fit.indices)
    point[chosen] += whole[: len(chosen)]
    point[list(flight.nuisances.indices)] += whole[len(chosen) + flight.nuisances.places(0)]
    held = fit.indices[:3]
    there = restricted(fit.at([point]), held)
    free = np.arange(3, whole.size)
    alone = np.linalg.solve(fit.information[np.ix_(free, free)], (J.T @ r)[free])
    np.testing.assert_array_equal(there.values[:3], 0.0)
    scale = np.sqrt(np.diag(fit.covariance))
    np.testing.assert_allclose(there.values[3:] / scale[3:6], alone[:3] / scale[3:6], atol=1e-6)
    np.testing.assert_array_equal(there.information, fit.information)
