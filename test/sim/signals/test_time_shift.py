"""Shifts by fractions of a sample, and smooth approximations of corners."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.sim.signals.smooth import soft_clip, soft_dead_zone, soft_onset
from sysid_node.sim.signals.time_shift import shift_cubic, shift_linear, shift_near_zero

SERIES = jnp.asarray(np.random.default_rng(0).standard_normal((40, 2)).cumsum(axis=0))


@pytest.mark.parametrize("shift", [shift_linear, shift_cubic])
def test_whole_shifts_are_exact_and_ends_are_held(shift):
    np.testing.assert_array_equal(shift(SERIES, jnp.asarray(0.0)), SERIES)
    late, early = np.asarray(shift(SERIES, jnp.asarray(3.0))), np.asarray(shift(SERIES, jnp.asarray(-2.0)))
    np.testing.assert_array_equal(late[3:], SERIES[:-3])
    np.testing.assert_array_equal(late[:3], np.tile(SERIES[0], (3, 1)))
    np.testing.assert_array_equal(early[:-2], SERIES[2:])
    np.testing.assert_array_equal(early[-2:], np.tile(SERIES[-1], (2, 1)))
    np.testing.assert_array_equal(shift(SERIES, jnp.asarray(1e6)), np.tile(SERIES[0], (40, 1)))


def test_cubic_is_exact_for_parabolas_and_linear_for_lines():
    time = jnp.arange(30.0)
    np.testing.assert_allclose(shift_cubic(time**2, jnp.asarray(0.3))[3:-3], ((time - 0.3) ** 2)[3:-3], atol=1e-12)
    np.testing.assert_allclose(shift_linear(time, jnp.asarray(2.7))[3:], (time - 2.7)[3:], atol=1e-12)


def test_shift_near_zero_has_the_cubics_value_and_slope():
    at_zero = [jax.jvp(lambda s: f(SERIES, s), (0.0,), (1.0,)) for f in (shift_cubic, shift_near_zero)]  # noqa: B023
    np.testing.assert_allclose(at_zero[0][0], at_zero[1][0])
    np.testing.assert_allclose(at_zero[0][1], at_zero[1][1], atol=1e-12)


@pytest.mark.slow
def test_soft_corners():
    x = jnp.linspace(-3.0, 3.0, 601)
    assert np.abs(soft_clip(x, 1.0) - jnp.clip(x, -1, 1)).max() < 0.044
    np.testing.assert_array_equal(soft_clip(x, 0.0), x)
    exact = x - jnp.clip(x, -0.5, 0.5)
    assert np.abs(soft_dead_zone(x, jnp.asarray(0.5)) - exact).max() < 0.006
    np.testing.assert_array_equal(soft_dead_zone(x, jnp.asarray(0.0)), x)
    slope = jax.vmap(jax.grad(soft_dead_zone, argnums=1), (0, None))(x, 0.0)
    np.testing.assert_allclose(np.delete(slope, 300), np.delete(-jnp.sign(x), 300), atol=1e-12)  # but at x = 0
    assert soft_onset(jnp.asarray([0.0, 1.0, 2.0]), jnp.asarray(1.0)) == pytest.approx([0.0, 0.5, 1.0], abs=1e-8)
