"""Estimates fall due at the rate of publication, at the samples that are freshest then."""

import numpy as np
import pytest
from due_times import due_times


def at_once(time: np.ndarray) -> np.ndarray:
    """No sample waits for another message."""
    return np.zeros(time.size)


def test_every_tenth_sample_of_a_regular_record() -> None:
    time = np.arange(2001) / 200.0
    np.testing.assert_array_equal(due_times(time, at_once(time), 20.0), time[10::10])


@pytest.mark.parametrize("seed", range(5))
def test_jitter_does_not_move_an_estimate_to_a_neighbour(seed: int) -> None:
    rng = np.random.default_rng(seed)
    regular = np.arange(2001) / 200.0
    jittered = regular + rng.uniform(-0.001, 0.001, regular.size)
    places = np.searchsorted(jittered, due_times(jittered, at_once(jittered), 20.0))
    np.testing.assert_array_equal(places, np.arange(10, 2001, 10))


@pytest.mark.parametrize("late", [0.0, 1e-4, -1e-4])
@pytest.mark.parametrize("phase", range(4))
def test_the_freshest_of_the_samples_that_air_data_complete(phase: int, late: float) -> None:
    """400 Hz, every fourth sample stamped with air data or 0.1 ms off, estimates at 50 Hz: of the last before each."""
    time, air = np.arange(4001) / 400.0, (np.arange(1010) + 0.25 * phase) / 100.0 + late
    air = np.round(air[air > -1e-9], 9)
    wait = air[np.searchsorted(air, np.round(time, 9))] - time
    found = due_times(time, wait, 50.0)
    assert wait[np.searchsorted(time, found[5:])].max() == pytest.approx(wait[50:90].min(), abs=1e-8)
    np.testing.assert_allclose(np.diff(found[5:]), 0.02)


def test_who_asks_for_every_sample_gets_every_sample() -> None:
    time = np.arange(400) / 400.0
    wait = (-np.arange(400) % 4) / 400.0
    np.testing.assert_array_equal(due_times(time, wait, 400.0), time[1:])


def test_air_data_at_the_imus_rate_but_between_its_samples() -> None:
    """All samples wait alike, none is fresher."""
    time = np.arange(2001) / 200.0
    found = due_times(time, np.full(time.size, 0.003), 20.0)
    np.testing.assert_array_equal(found[1:], time[20::10])


def test_one_estimate_for_a_sample_after_a_long_gap() -> None:
    time = np.array([0.0, 0.01, 10.0, 10.01])
    assert due_times(time, at_once(time), 20.0).tolist() == [10.0]
