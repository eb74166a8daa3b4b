"""Measured against predicted: nothing but the sensors' noise is left where the simulator is the aircraft."""

import numpy as np


def test_only_noise_is_left_of_the_same_aircraft(plain_view) -> None:
    residual = np.abs(plain_view.residual(plain_view.simulator.neutral())[:, 1:]) ** 2
    ratio = residual.mean(axis=0).sum(axis=0) / plain_view.noise[1:].sum(axis=0)
    assert (ratio[[0, 1, 2, 4]] < 3.0).all() and (ratio < 8.0).all(), ratio


def test_slopes_agree_with_differences(plain_view) -> None:
    names, neutral = plain_view.simulator.names, plain_view.simulator.neutral()
    index = names.index("derivative_error.Cm_alpha")
    step = np.zeros_like(neutral)
    step[index] = 1e-4
    numeric = (plain_view.predicted(neutral + step) - plain_view.predicted(neutral - step)) / 2e-4
    slopes = plain_view.slopes(neutral, [index])[..., 0]
    np.testing.assert_allclose(slopes, numeric, atol=1e-6 * np.abs(numeric).max())
