"""Renewals in steps.

Truth: the same renewals made at once.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.bag.reader import read_streams
from sysid_node.online import estimator
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.estimates.published import estimate
from sysid_node.online.frequency.fourier_transform import impulse
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import EstimatorState
from test.online.plant import fly, made_aircraft, multisteps

BAGS = Path(__file__).resolve().parents[3] / "bags"
RATE = 50.0
AIRCRAFT = made_aircraft(stated_tolerances={"actuator_lag.elevator": 0.05, "geometry.S": 0.005})
Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def flown() -> tuple[Array, Array]:
    """Times and samples of a flight whose elevator moves 60 ms after its command."""
    time, samples = fly(made_aircraft(), multisteps(14.0, RATE), RATE, seed=3)
    early = samples[0].copy()
    early[:-3, -3] = early[3:, -3]
    return time, early


def started(**settings: float) -> EstimatorState:
    return estimator.init(AIRCRAFT, OnlineSettings(**settings), commanded=True)


@pytest.mark.parametrize("settings", [{}, {"forgetting_time": 8.0}, {"window": 6.0}])
def test_steps_with_the_samples_that_follow_find_what_is_found_at_once(flown, settings: dict[str, float]) -> None:
    """Servos move here, segments end, and old ones are forgotten; sums differ in the order of their terms alone."""
    spread, at_once = started(**settings), started(**settings)
    waited = 0
    for moment, sample in zip(flown[0].tolist(), flown[1].tolist(), strict=True):
        estimator.update(spread, moment, sample)
        waited += spread.pending is not None
        estimator.update(at_once, moment, sample)
        estimator.complete(at_once)
    estimator.complete(spread)
    assert waited > 50  # samples came while a renewal was under way
    one, other = spread.latest, at_once.latest
    assert one is not None and other is not None and one.systematic is not None and other.systematic is not None
    servos = spread.controls.servos
    assert servos is not None and servos.lateness.max() > 0.03  # a servo has moved
    np.testing.assert_allclose(one.solution.theta, other.solution.theta, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(one.later.factors, other.later.factors, rtol=1e-9)
    np.testing.assert_allclose(one.systematic.servos.lateness, other.systematic.servos.lateness, rtol=1e-9, atol=1e-12)
    found, expected = estimate(spread).derivatives, estimate(at_once).derivatives
    for name, row in expected.items():
        assert found[name].value == pytest.approx(row.value, rel=1e-9)
        assert found[name].standard_error == pytest.approx(row.standard_error, rel=1e-9)
        assert found[name].status == row.status


def test_estimates_hold_every_sample_while_a_segment_is_being_finished(flown) -> None:
    """Between two samples the estimates change by little, whether or not a segment has ended between them."""
    state, ends, largest = started(window=30.0), 0, 0.0
    before, start = np.nan, np.nan
    for moment, sample in zip(flown[0].tolist(), flown[1].tolist(), strict=True):
        estimator.update(state, moment, sample)
        row = estimate(state).derivatives["Cm_alpha"]
        ended = state.segment.start != start and np.isfinite(start)
        if ended and state.pending is not None and row.standard_error < 1.0:
            ends += 1
            largest = max(largest, abs(row.value - before) / row.standard_error)
        before, start = row.value, state.segment.start
    assert ends and largest < 0.2


@pytest.mark.slow
def test_the_impulse_at_the_start_is_of_the_segment_under_way() -> None:
    """Segments end here, and one begins later than it did, as the elevator is found to have lost half its effect."""
    aircraft, settings = load_aircraft("cdrw"), OnlineSettings()
    aligned = align_streams(aircraft, read_streams(BAGS / "cdrw_failed_elevator"), settings.max_gap)
    state, starts = estimator.init(aircraft, settings), [np.nan]
    for moment, sample in zip(aligned.time.tolist(), aligned.samples.tolist(), strict=True):
        estimator.update(state, moment, sample)
        if state.segment.start not in starts and np.isfinite(state.segment.start):
            starts.append(state.segment.start)
            expected = impulse(state.model.spectrum.omega, state.segment.start)
            np.testing.assert_array_equal(state.segment.start_impulse, expected)
    assert np.isfinite(state.changes.changed_at)
    assert np.diff(starts[1:]).min() < 0.9 * state.model.times.length
