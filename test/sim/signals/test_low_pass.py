"""The low-pass before flights are compared; truth: the Gaussian's frequency response."""

import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.sim.signals.low_pass import CORNER, gaussian_taps, low_passed, low_passed_every


@pytest.mark.parametrize("rate", [100.0, 200.0, 400.0])
def test_the_gain_is_a_gaussian_with_the_corner_at_3_db(rate: float) -> None:
    taps, corner = gaussian_taps(rate, 50.0), CORNER * 50.0
    offsets = (np.arange(taps.size) - taps.size // 2) / rate
    for frequency in (0.0, 4.0, corner, 20.0):
        gain = np.sum(taps * np.cos(2.0 * np.pi * frequency * offsets))
        assert gain == pytest.approx(2.0 ** (-0.5 * (frequency / corner) ** 2), abs=2e-4)


def test_a_rate_below_the_corner_is_left_as_it_is() -> None:
    np.testing.assert_array_equal(gaussian_taps(20.0, 50.0), [1.0])


def test_the_compiled_filter_is_the_same_at_every_other_sample() -> None:
    series = np.cumsum(np.random.default_rng(1).normal(size=(201, 2)), axis=0)[:200]
    kept = low_passed_every(jnp.asarray(series), 2)
    whole = np.column_stack([low_passed(column, gaussian_taps(100.0, 50.0)) for column in series.T])
    np.testing.assert_allclose(kept, whole[::2], atol=1e-6 * np.abs(series).max())
