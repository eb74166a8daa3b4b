"""The relative precision of estimates, by hand."""

import math

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.excite.relative_precision import LEAST_SIZE, relative_precision
from sysid_node.online.types import DerivativeEstimate

CDRW = load_aircraft("cdrw")


def estimate(value: float, half: float, valid: bool = True) -> DerivativeEstimate:
    return DerivativeEstimate("Cm_q", value, 0.5 * half, value - half, value + half, valid, "ok")


def test_half_an_interval_over_the_size() -> None:
    assert relative_precision([estimate(-20.0, 1.0)], CDRW)["Cm_q"] == pytest.approx(0.05)


def test_what_excitation_cannot_lower_does_not_count() -> None:
    """Of a standard error of 0.5 the noise makes 0.3, the tolerances 0.4."""
    part = estimate(-20.0, 1.0)._replace(statistical_error=0.3, systematic_error=0.4)
    assert relative_precision([part], CDRW)["Cm_q"] == pytest.approx(0.05 * 0.6)


def test_a_small_value_counts_as_a_share_of_the_files() -> None:
    size = LEAST_SIZE * abs(CDRW.derivatives["Cm_q"].value)
    assert relative_precision([estimate(0.001, 1.0)], CDRW)["Cm_q"] == pytest.approx(1.0 / size)


def test_what_is_not_valid_is_not_known() -> None:
    assert relative_precision([estimate(-20.0, 1.0, valid=False)], CDRW)["Cm_q"] == math.inf
