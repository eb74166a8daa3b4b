"""How numbers and names are put; the expected texts are written out by hand."""

import math

import pytest

from sysid_node.aircraft.names import STANDARD_DERIVATIVES
from sysid_node.report.wording import names, numbers


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        (-1.4372, 0.0331, "−1.437 ± 0.033"),
        (3.212, 0.0999, "3.21 ± 0.10"),
        (-27.06, 12.3, "−27 ± 12"),
        (412.3, 151.0, "412 ± 151"),
        (-0.0001, 0.02, "0.000 ± 0.020"),
        (-7.0153e-6, 1.2e-7, "(−7.02 ± 0.12) × 10⁻⁶"),
        (0.0, 0.0, "0 ± 0"),
        (2.5, math.nan, "2.50"),
        (2.5, math.inf, "2.50"),
        (math.nan, 1.0, "–"),
    ],
)
def test_with_interval(value, half, text):
    assert numbers.with_interval(value, half).replace("\u202f", " ") == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (-0.5, "−0.500"), (99.96, "100"), (1234.5, "1234"), (-3.016e-24, "−3.02 × 10⁻²⁴"), (math.inf, "∞")],
)
def test_number(value, text):
    assert numbers.number(value).replace("\u202f", " ") == text


@pytest.mark.parametrize(("value", "text"), [(92.43, "92.4"), (1.54e-5, "0"), (100.0, "100"), (-3.06, "−3.10")])
def test_percentage(value, text):
    assert numbers.percentage(value) == text


def test_number_says_when_there_is_none():
    assert numbers.number(math.nan) == numbers.NONE


def test_seconds():
    assert [numbers.seconds(s).replace("\u202f", " ") for s in (8.0, 60.0, 600.0, 754.6)] == [
        *("8 s", "60 s"),
        *("10 min 0 s", "12 min 35 s"),
    ]


def test_listing_counts_what_is_too_much():
    assert numbers.listing(["a"]) == "a"
    assert numbers.listing(["a", "b", "c"]) == "a, b and c"
    assert numbers.listing(list("abcdefg"), most=4) == "a, b, c and 4 others"


def test_every_standard_derivative_has_words_of_its_own():
    said = [names.meaning(name) for name in STANDARD_DERIVATIVES]
    assert len(set(said)) == len(said)
    assert not any("_" in text for text in said)


def test_no_probability_is_certainty():
    assert [numbers.likely(p) for p in (1.0, 0.9996, 0.994, 0.8312, 0.005, 0.0)] == [
        *("over 0.99", "over 0.99", "0.99", "0.83", "0.01", "under 0.01")
    ]


def test_symbols():
    assert names.symbol("Cm_alpha") == '<span class="symbol"><i>C</i><sub>m\u202fα</sub></span>'
    assert "δe" in names.symbol("CL_de")
    assert "δf" in names.symbol("CL_df")  # a flap
    assert names.symbol("bias <q>") == "bias &lt;q&gt;"


def test_units():
    assert names.unit("Cm_alpha") == "per rad"
    assert names.unit("CL_0") == ""
    assert names.unit("CD_k") == "per CL²"
    assert names.unit("bias_q") == ""


def test_settings():
    assert numbers.setting((0.1, 0.04, 2.0)) == "0.1 : 0.04 : 2"
    assert numbers.setting([0.1, 0.04, 2.0]) == "0.1 : 0.04 : 2"
    assert [numbers.setting(v) for v in (True, False, 0.0, 30.0, "sls_rft", None)] == [
        *("yes", "no", "0", "30", "sls_rft", "–")
    ]
