"""One estimate: its interval and its validity."""

import numpy as np
import pytest

from sysid_node.batch.results.estimate import ParameterEstimate, confidence_interval


@pytest.mark.parametrize(("freedom", "quantile"), [(np.inf, 1.960), (10.0, 2.228), (25.0, 2.060)])
def test_the_interval_is_students(freedom, quantile):
    """Quantiles as printed in any table of Student's t, e.g. Abramowitz & Stegun (1964), table 26.10."""
    lower, upper = confidence_interval(3.0, 2.0, freedom)
    assert (upper - 3.0) / 2.0 == pytest.approx(quantile, abs=5e-4)
    assert upper + lower == pytest.approx(6.0)


def test_an_estimate_marked_invalid_keeps_its_numbers():
    estimate = ParameterEstimate("Cm_q", -12.0, 1.0, -14.0, -10.0, True, "ok", 0.9)
    marked = estimate.invalid("not excited")
    assert (marked.valid, marked.status) == (False, "not excited")
    assert (marked.value, marked.lower, marked.upper) == (-12.0, -14.0, -10.0)
