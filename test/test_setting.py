"""One setting from a text or a plain value."""

from typing import Any

import pytest

from sysid_node.errors import InputError
from sysid_node.setting import check_frequencies, parse_setting

Frequencies = tuple[float, float, float]
Names = tuple[str, ...]


@pytest.mark.parametrize(
    ("kind", "value", "meant"),
    [
        (float, "0.5", 0.5),
        (int, 3, 3),
        (str, "iv_rft", "iv_rft"),
        (bool, "No", False),
        (bool, True, True),
        (Frequencies, "0.1:0.04:2", (0.1, 0.04, 2.0)),
        (Frequencies, [0.1, 0.04, 2.0], (0.1, 0.04, 2.0)),
        (Names, "V, alpha,", ("V", "alpha")),
        (Names, ("V",), ("V",)),
    ],
)
def test_texts_and_plain_values_are_understood(kind: Any, value: Any, meant: Any) -> None:
    assert parse_setting("key", kind, value) == meant


@pytest.mark.parametrize(
    ("kind", "value", "wanted"),
    [
        (float, "fast", "a float"),
        (bool, "maybe", "a bool"),
        (Frequencies, "0.1:2", "START:STEP:STOP in Hz"),
        (Frequencies, 3.0, "START:STEP:STOP in Hz"),
    ],
)
def test_others_are_refused_in_one_line(kind: Any, value: Any, wanted: str) -> None:
    with pytest.raises(InputError) as refused:
        parse_setting("key", kind, value)
    assert str(refused.value) == f"setting key = {value!r}: expected {wanted}"


@pytest.mark.parametrize("frequencies", [(0.0, 0.1, 2.0), (2.0, 0.1, 1.0), (0.1, -0.1, 2.0), (0.1, 0.1, float("inf"))])
def test_frequencies_must_rise_from_above_zero(frequencies: Frequencies) -> None:
    with pytest.raises(InputError, match="expected 0 < start < stop and step > 0, in Hz"):
        check_frequencies(frequencies)


@pytest.mark.parametrize("frequencies", [(0.1, 5.0, 2.0), (3.0, 999.0, 1000.0)])
def test_a_spectrum_has_two_lines_or_more(frequencies: Frequencies) -> None:
    with pytest.raises(InputError, match="expected two lines or more"):
        check_frequencies(frequencies)
    check_frequencies((0.1, 0.1, 0.2))


@pytest.mark.parametrize("text", ["1e-300:1e-300:1e-299", "1e300:1e300:1e301", "0.1:1e-300:1"])
def test_frequencies_that_no_flight_has_or_too_many_are_refused(text):
    with pytest.raises(InputError, match=r"at most 100000 lines"):
        check_frequencies(parse_setting("frequencies", tuple[float, float, float], text))
