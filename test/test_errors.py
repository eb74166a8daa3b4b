"""Warnings that are noted: truth is what was given."""

import warnings

import pytest

from sysid_node.errors import InputError, InputWarning, noted_warnings


def test_warnings_are_noted_once_and_given_all_the_same() -> None:
    noted: list[str] = []
    with pytest.warns() as given, noted_warnings(noted):
        for text in ("flight: two\n  clocks", "flight: two clocks", "flight: no vanes"):
            warnings.warn(text, InputWarning, stacklevel=1)
        warnings.warn("of another kind", UserWarning, stacklevel=1)
    assert noted == ["flight: two clocks", "flight: no vanes"]
    assert [one.category for one in given] == [InputWarning, InputWarning, InputWarning, UserWarning]


def test_an_error_takes_no_warning_away() -> None:
    noted: list[str] = []
    with pytest.warns(InputWarning, match="no vanes"), pytest.raises(InputError), noted_warnings(noted):
        warnings.warn("flight: no vanes", InputWarning, stacklevel=1)
        raise InputError("no such flight")
    assert noted == ["flight: no vanes"]
