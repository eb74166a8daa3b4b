"""Segments of a manoeuvre, and the manoeuvre that they make."""

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.excite.kinds import KINDS
from sysid_node.excite.segment import draw_manoeuvre, moved
from sysid_node.excite.spec import parse_manoeuvre, parse_segments

CDRW = load_aircraft("cdrw")


def test_repeats():
    manoeuvre = parse_manoeuvre("doublet:aileron:amplitude=0.1:width=0.5:start=1:repeat=3:every=4", CDRW)
    rises = np.flatnonzero(np.diff(manoeuvre.deflections["aileron"]) > 0.15 - 1e-9)
    starts = np.flatnonzero((manoeuvre.deflections["aileron"][1:] > 0) & (manoeuvre.deflections["aileron"][:-1] == 0))
    assert rises.size == 0
    assert np.allclose(manoeuvre.time[starts + 1], [1, 5, 9])
    unsaid = parse_manoeuvre("doublet:aileron:amplitude=0.1:width=0.5:start=1:repeat=3", CDRW)
    assert unsaid.duration == pytest.approx(1 + 2 * 2 + 1 + 3)  # one second after each end


def test_duration_pads():
    manoeuvre = parse_manoeuvre("doublet:elevator:amplitude=0.1", CDRW, rate=50.0, duration=60.0)
    assert manoeuvre.duration == 60.0
    assert manoeuvre.time.size == 3001


def test_too_short_a_flight():
    with pytest.raises(InputError, match=r"lasts until 2 s, but the flight 1.5 s"):
        parse_manoeuvre("doublet:elevator:amplitude=0.1", CDRW, duration=1.5)


@pytest.mark.parametrize("kind", KINDS)
def test_text_gives_the_segment_back(kind):
    (segment,) = parse_segments(f"{kind}:elevator,rudder:amplitude=0.1,0.05:start=2.5:repeat=2", CDRW)
    assert parse_segments(segment.text(), CDRW) == (segment,)
    later = moved(segment, 7.25)
    assert later.values["start"] == 7.25
    assert draw_manoeuvre([later], CDRW).spec == later.text()


@pytest.mark.parametrize(("width", "rate"), [(0.001, 100.0), (0.019, 100.0), (0.039, 50.0)])
def test_steps_shorter_than_two_samples_are_refused(width, rate):
    """They would be drawn as steps of another length, or not at all."""
    with pytest.raises(InputError, match=rf"steps of {width:g} s cannot be drawn at {rate:g} Hz; make them at least"):
        parse_manoeuvre(f"3211:elevator:amplitude=0.05:width={width}", CDRW, rate)
    assert parse_manoeuvre(f"3211:elevator:amplitude=0.05:width={2 / rate}", CDRW, rate).moved == ("elevator",)
