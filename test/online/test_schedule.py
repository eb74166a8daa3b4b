"""Estimates fall due at the same samples one by one and all at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid_node.online.schedule import Schedule, due, due_times


def one_by_one(time: np.ndarray, rate: float) -> np.ndarray:
    schedule = Schedule(rate)
    return time[[due(schedule, t) for t in time.tolist()]]


def test_every_tenth_sample_of_a_regular_record() -> None:
    time = np.arange(2001) / 200.0
    np.testing.assert_array_equal(due_times(time, 20.0), time[10::10])


@pytest.mark.parametrize("seed", range(5))
def test_jitter_does_not_move_an_estimate_to_a_neighbour(seed: int) -> None:
    rng = np.random.default_rng(seed)
    regular = np.arange(2001) / 200.0
    jittered = regular + rng.uniform(-0.001, 0.001, regular.size)
    places = np.searchsorted(jittered, due_times(jittered, 20.0))
    np.testing.assert_array_equal(places, np.arange(10, 2001, 10))


@given(
    st.lists(st.floats(1e-4, 2.0), min_size=1, max_size=200),
    st.floats(0.01, 1000.0),
)
def test_one_by_one_equals_all_at_once(steps: list[float], rate: float) -> None:
    time = np.concatenate([[0.0], np.cumsum(steps)])
    np.testing.assert_array_equal(due_times(time, rate), one_by_one(time, rate))


def test_one_estimate_for_a_sample_after_a_long_gap() -> None:
    time = np.array([0.0, 0.01, 10.0, 10.01])
    assert due_times(time, 20.0).tolist() == [10.0]
    assert one_by_one(time, 20.0).tolist() == [10.0]
