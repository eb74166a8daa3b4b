"""Recursive least squares and its relatives: what they must equal, and what holds them."""

import numpy as np
import pytest
from made_flight import KESTREL, KINKS, clean, flight, largest_error

from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.methods.recursive_least_squares import recursive_least_squares


def test_a_pass_along_the_flights_is_unfiltered_equation_error():
    records = [flight(1), flight(2, turn=-1)]
    passed, whole = recursive_least_squares(KESTREL, records), equation_error(KESTREL, records, low_pass=0.0)
    for name, estimate in passed.estimates.items():
        assert estimate.value == pytest.approx(whole.values[name], rel=1e-4, abs=1e-6), name


def test_standard_errors_hold_the_colour_of_the_residuals_and_the_bias():
    """Coloured residuals make them larger than the recursion's own; the bias is that of noise on the regressors."""
    records = [flight(1), flight(2, turn=-1)]
    passed, corrected = recursive_least_squares(KESTREL, records), equation_error(KESTREL, records)
    coloured = equation_error(KESTREL, records, low_pass=0.0)
    for name, estimate in passed.estimates.items():
        bias = estimate.value - corrected.values[name]
        assert estimate.standard_error >= 0.99 * abs(bias), name
        expected = np.hypot(bias, coloured.estimates[name].standard_error)
        assert estimate.standard_error == pytest.approx(expected, rel=0.15), name


def test_clean_flights_give_the_truth():
    assert largest_error(recursive_least_squares(KESTREL, [clean(), clean(turn=-1)])) < KINKS
