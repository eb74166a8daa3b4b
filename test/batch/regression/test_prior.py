"""The tolerances of the aircraft file, and their defaults."""

import dataclasses

import pytest
from made_flight import KESTREL

from sysid_node.batch.regression.prior import tolerance_of


@pytest.mark.parametrize(
    ("value", "tolerance", "expected"), [(-12.0, 3.0, 3.0), (-12.0, None, 6.0), (0.01, None, 0.05)]
)
def test_the_file_comes_first_then_half_the_value_then_a_least_one(value, tolerance, expected):
    derivative = dataclasses.replace(KESTREL.derivatives["Cm_q"], value=value, tolerance=tolerance)
    aircraft = dataclasses.replace(KESTREL, derivatives={"Cm_q": derivative})
    assert tolerance_of(aircraft, "Cm_q") == expected
