"""A manoeuvre and the limits of the aircraft's controls."""

from dataclasses import replace

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.excite.manoeuvre import control_limits
from sysid_node.excite.spec import parse_manoeuvre

CDRW = load_aircraft("cdrw")


def test_limits_are_the_aircrafts():
    assert control_limits(CDRW) == {"elevator": 0.35, "aileron": 0.35, "rudder": 0.35, "throttle": 1.0}
    parse_manoeuvre("pulse:elevator:amplitude=0.35", CDRW)
    with pytest.raises(InputError, match=r"elevator moves 0.36 rad from trim at 1.00 s, but cdrw's limit is 0.35 rad"):
        parse_manoeuvre("pulse:elevator:amplitude=0.36", CDRW)
    with pytest.raises(InputError, match=r"elevator moves 0.4 rad from trim"):
        parse_manoeuvre("pulse:elevator:amplitude=0.2+doublet:elevator:amplitude=0.2", CDRW)
    without = replace(CDRW, throttle=None)
    with pytest.raises(InputError, match="no control 'throttle'"):
        parse_manoeuvre("pulse:throttle:amplitude=0.1", without)
