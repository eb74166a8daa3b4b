"""Derivatives, low-pass and averages of signals."""

import numpy as np
import pytest

from sysid_node.batch.regression.filtering import block_averaged, differentiate, lowpass
from sysid_node.flight.record import FlightRecord

TIME = np.arange(500) / 50.0


def test_a_quartic_is_differentiated_exactly():
    t = TIME - 5.0
    found = differentiate(TIME, t**4 - 2.0 * t**2 + t)
    np.testing.assert_allclose(found[2:-2], (4.0 * t**3 - 4.0 * t + 1.0)[2:-2], rtol=1e-9, atol=1e-9)


def test_even_samples_give_the_fourth_order_central_difference():
    x = np.random.default_rng(1).normal(size=500)
    stencil = (8.0 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / 12.0 * 50.0
    np.testing.assert_allclose(differentiate(TIME, x)[2:-2], stencil, rtol=1e-8, atol=1e-8)


def test_uneven_samples_are_differentiated_at_their_own_times():
    time = np.sort(TIME + np.random.default_rng(2).uniform(-0.008, 0.008, 500))
    found = differentiate(time, np.sin(4.0 * time))
    np.testing.assert_allclose(found[2:-2], 4.0 * np.cos(4.0 * time)[2:-2], atol=2e-4)


def test_a_wide_window_smooths():
    x = np.random.default_rng(3).normal(size=500)
    assert differentiate(TIME, x, half_width=8, degree=2).std() < 0.1 * differentiate(TIME, x).std()


@pytest.mark.parametrize("gap", [0.3, 30.0, 3.6e3, 1.0e9])
def test_no_slope_is_taken_across_an_interruption(gap):
    """Truth: each side's own derivative. A window across a long gap has a singular matrix."""
    x = np.random.default_rng(5).normal(size=500)
    time = np.where(np.arange(500) < 200, TIME, TIME + gap)
    found = differentiate(time, x)
    np.testing.assert_array_equal(found[:200], differentiate(time[:200], x[:200]))
    np.testing.assert_array_equal(found[200:], differentiate(time[200:], x[200:]))


def test_short_pieces_are_differentiated_as_far_as_they_go():
    """Truth: straight lines of slopes 2 and 3; a sample alone has no slope."""
    time = np.concatenate([TIME[:50], [10.0], 20.0 + TIME[:2], 30.0 + TIME[:3]])
    found = differentiate(time, np.where(time < 25.0, 2.0 * time, 3.0 * time))
    np.testing.assert_allclose(found, np.repeat([2.0, np.nan, 2.0, 3.0], [50, 1, 2, 3]), rtol=1e-9)


def test_lowpass_keeps_the_band_undelayed_and_drops_the_rest():
    slow, fast = np.sin(2 * np.pi * 0.8 * TIME), np.sin(2 * np.pi * 20.0 * TIME)
    found = lowpass(TIME, (slow + fast)[:, None], 5.0)[:, 0]
    np.testing.assert_allclose(found[50:-50], slow[50:-50], atol=0.005)


@pytest.mark.parametrize("cutoff", [0.0, 25.0, 1000.0])
def test_a_cutoff_outside_the_band_changes_nothing(cutoff):
    x = np.random.default_rng(4).normal(size=(500, 2))
    np.testing.assert_array_equal(lowpass(TIME, x, cutoff), x)


def test_averages_use_every_sample_and_keep_their_instant():
    record = FlightRecord(TIME, {"V": 3.0 * TIME + 1.0, "alpha": np.where(TIME < 1.0, np.nan, 1.0)}, "flight")
    found = block_averaged(record, 12.0)  # four samples of 50 Hz
    assert len(found) == 125
    np.testing.assert_allclose(found["V"], 3.0 * found.time + 1.0)
    assert np.isnan(found["alpha"][:12]).all()
    assert block_averaged(record, 0.0) is record
    assert block_averaged(record, 49.0) is record
