"""Thinned records keep their extremes, gaps and ends."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sysid_node.flight.record import FlightRecord
from sysid_node.report.drawing.thinning import MAX_ROWS, extremes, thin_curve, thin_flight


@given(st.integers(0, 2**32 - 1), st.integers(1, 5000), st.integers(1, 50))
def test_extremes_hold_every_buckets_minimum_and_maximum(seed, count, buckets):
    values = np.random.default_rng(seed).normal(size=count)
    kept = extremes(values, buckets)
    assert np.all(np.diff(kept) > 0)
    assert kept.size <= max(3 * buckets + 2, min(count, 3 * buckets))
    assert kept[0] == 0
    assert kept[-1] == count - 1
    if count > 3 * buckets:
        size = -(-count // buckets)
        for start in range(0, count, size):
            inside = kept[(kept >= start) & (kept < start + size)]
            assert values[inside].max() == values[start : start + size].max()
            assert values[inside].min() == values[start : start + size].min()


def test_a_gap_stays_a_gap():
    values = np.sin(np.arange(9000) / 50.0)
    values[4000:4003] = np.nan
    _, thinned = thin_curve(np.arange(9000.0), values, points=600)
    assert thinned.size <= 600
    assert np.isnan(thinned).sum() >= 1


def test_all_nan_is_thinned_without_a_word():
    _, thinned = thin_curve(np.arange(9000.0), np.full(9000, np.nan), points=300)
    assert thinned.size <= 300
    assert np.isnan(thinned).all()


def test_flight_is_thinned_to_its_own_samples_once():
    time = np.arange(100_000) / 100.0
    columns = {name: np.random.default_rng(i).normal(size=time.size) for i, name in enumerate(("p", "q", "de"))}
    thin = thin_flight(FlightRecord(time, columns))
    assert len(thin) <= MAX_ROWS
    rows = np.searchsorted(time, thin.time)
    for name, values in columns.items():
        np.testing.assert_array_equal(thin[name], values[rows])
        assert (thin[name].min(), thin[name].max()) == (values.min(), values.max())
    assert thin_flight(thin) is thin


def test_short_flight_is_left_alone():
    flight = FlightRecord(np.arange(5.0), {"q": np.zeros(5)})
    assert thin_flight(flight) is flight
