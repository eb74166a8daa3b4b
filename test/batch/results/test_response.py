"""Measured and modelled outputs, and the coefficient of determination."""

import numpy as np
import pytest

from sysid_node.batch.results.response import ModelResponse, goodness_of_fit

TIME = np.arange(4.0)


def response(measured, modelled):
    return ModelResponse("flight", TIME, ("q", "az"), np.array(measured), np.array(modelled))


def test_the_goodness_of_fit_is_counted_over_all_flights():
    """Worked by hand: measured 1 2 3 4 and 5 6 7 8, residuals of 1 in the second flight alone."""
    first = response([[1, 9], [2, 9], [3, 9], [4, 9]], [[1, 9], [2, 9], [3, 9], [4, 9]])
    second = response([[5, 9], [6, 9], [7, 9], [8, 9]], [[4, 9], [5, 9], [6, 9], [7, 9]])
    fit = goodness_of_fit([first, second])["q"]
    assert fit.r_squared == pytest.approx(1.0 - 4.0 / 42.0)
    assert fit.residual_std == pytest.approx(np.sqrt(0.5))
    assert fit.samples == 8


def test_what_was_not_measured_does_not_count_and_a_constant_has_no_r_squared():
    found = goodness_of_fit([response([[1, 9], [np.nan, 9], [3, 9], [4, np.nan]], [[1, 8], [0, 8], [3, 8], [4, 8]])])
    assert found["q"].samples == 3
    assert found["q"].r_squared == 1.0
    assert np.isnan(found["az"].r_squared)
    assert found["az"].residual_std == 1.0


def test_nothing_measured_is_not_a_number():
    found = goodness_of_fit([response([[np.nan, 1]] * 4, [[0, 1]] * 4)])
    assert found["q"].samples == 0
    assert np.isnan(found["q"].residual_std)
