"""The number of independent values in flights: the sampling theorem, by hand."""

import numpy as np
import pytest

from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.errors import InputError

TEN_SECONDS = np.arange(1001) * 0.01


def test_a_band_of_three_hertz_holds_six_values_a_second():
    assert effective_degrees_of_freedom(["a", "b"], [TEN_SECONDS], 3.0) == pytest.approx(60.0 - 2.0)
    assert effective_degrees_of_freedom(["a"], [TEN_SECONDS, TEN_SECONDS], 3.0) == pytest.approx(120.0 - 1.0)


@pytest.mark.parametrize("low_pass", [0.0, 80.0])
def test_no_more_values_than_samples(low_pass):
    assert effective_degrees_of_freedom(["a"], [TEN_SECONDS], low_pass) == pytest.approx(1000.0 - 1.0)


def test_a_flight_that_its_model_would_fit_exactly_is_refused():
    with pytest.raises(InputError, match=r"0\.5 s of flight .* holds 3 independent values below 3 Hz, .* 3 unknowns"):
        effective_degrees_of_freedom(["a", "b", "c"], [TEN_SECONDS[:51]], 3.0)
