"""The exciter's settings and the ranges that they keep."""

import pytest

from sysid_node.errors import InputError
from sysid_node.excite.exciter_settings import RANGES, ExcitationSettings


def test_every_default_is_within_its_range():
    settings = ExcitationSettings()
    assert all(lower <= getattr(settings, name) <= upper for name, (lower, upper) in RANGES.items())


@pytest.mark.parametrize("name", RANGES)
def test_ends_are_allowed_and_what_is_beyond_refused(name):
    lower, upper = RANGES[name]
    for value in (lower, upper):
        assert getattr(ExcitationSettings(**{name: value}), name) == value
    for value in (lower - 0.1, upper + 0.1, float("nan")):
        with pytest.raises(InputError, match=f"setting {name} = "):
            ExcitationSettings(**{name: value})
