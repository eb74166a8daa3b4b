"""The data of a fit; truth: linear algebra written out, and the bounds of what is fitted."""

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import (
    CandidateFit,
    linearised,
    onset_places,
    step_limits,
    stepped,
    unfitted,
    with_candidates,
)
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.residuals.parameter_priors import bounds


@pytest.fixture(scope="module")
def start(aircraft, plain_model) -> CandidateFit:
    """Nuisances and a loss of effectiveness, which has a size and an onset, of two flights that are the same one."""
    nuisances = nuisances_of(aircraft, plain_model)
    (loss,) = (
        c
        for c in candidates_of(plain_model.simulator, [plain_model])
        if c.label == "control_effectiveness_loss of elevator"
    )
    return with_candidates(unfitted([plain_model, plain_model], nuisances), [loss], nuisances, [0.2, 8.0])


@pytest.mark.slow
def test_a_fit_without_candidates_starts_at_neutral(aircraft, plain_model) -> None:
    fit = unfitted([plain_model], nuisances_of(aircraft, plain_model))
    np.testing.assert_array_equal(fit.flights[0].point, plain_model.simulator.neutral())
    assert fit.values.size == 0 and fit.prior_score == 0.0 and fit.effects == frozenset()


@pytest.mark.slow
def test_new_candidates_start_where_they_are_told(start) -> None:
    np.testing.assert_array_equal(start.values, [0.2, 8.0])
    np.testing.assert_array_equal(start.sizing, [True, False])
    assert onset_places(start) == [1]


@pytest.mark.slow
def test_flights_share_derivatives_and_have_biases_of_their_own(start) -> None:
    chosen, shared, separate = start.sizes
    now, sigma, _ = start.stacked
    assert chosen == 2 and now.size == shared + 2 * separate == sigma.size
    first, second = (start.nuisances.places(number) for number in (0, 1))
    common = start.nuisances.shared
    np.testing.assert_array_equal(first[common], second[common])
    assert not set(first[~common]) & set(second[~common])
    assert sorted({*first, *second}) == list(range(now.size))


@pytest.mark.slow
def test_information_is_that_of_the_priors_and_of_all_slopes(start) -> None:
    fit = linearised(start)
    slopes = np.concatenate([flight.slopes.reshape(-1, flight.slopes.shape[2]) for flight in fit.flights])
    np.testing.assert_allclose(fit.information, fit.prior_information + slopes.T @ slopes, rtol=1e-10)
    squares = sum(np.sum(flight.rows**2) for flight in fit.flights)
    assert fit.cost == pytest.approx(squares - 2.0 * fit.prior_score)


@pytest.mark.slow
def test_an_onset_has_no_slope(start) -> None:
    fit = linearised(start)
    assert not fit.flights[0].slopes[..., 1].any() and fit.flights[0].slopes[..., 0].any()


@pytest.mark.slow
def test_no_step_leads_beyond_a_limit(start) -> None:
    least, greatest = step_limits(start)
    assert least[1] == greatest[1] == 0.0  # the onset
    low, high = bounds(start.simulator, start.indices)
    for step in (1e6 * np.ones_like(least), -1e6 * np.ones_like(least)):
        moved = stepped(start, step)
        now, _, limit = moved.stacked
        assert ((low <= moved.values) & (moved.values <= high)).all()
        np.testing.assert_allclose(np.abs(now), limit)


@pytest.mark.slow
def test_a_step_within_the_limits_is_taken_as_it_is(start) -> None:
    least, greatest = step_limits(start)
    step = 0.3 * np.where(np.random.default_rng(0).random(least.size) < 0.5, least, greatest)
    moved = stepped(start, step)
    np.testing.assert_allclose(np.append(moved.values - start.values, moved.stacked[0]), step, atol=1e-12)
