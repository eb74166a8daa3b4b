"""The free numbers of a manoeuvre as a point of the unit cube."""

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.excite.prediction import Predictor
from sysid_node.excite.search_space import SearchSpace
from sysid_node.excite.spec import parse_segments

CDRW = load_aircraft("cdrw")


@pytest.fixture(scope="module")
def predictor():
    return Predictor(CDRW, 50.0)


def test_points_and_segments_are_each_others_image(predictor):
    segments = parse_segments(
        ("3211:elevator,rudder:amplitude=0.05,-0.1:start=2.5", "sweep:throttle:amplitude=0.05:length=4:start=3"), CDRW
    )
    space = SearchSpace(predictor, segments, 12.0)
    point = space.encode(segments)
    assert point.shape == (space.size,)
    assert np.all((point > 0) & (point < 1))
    assert tuple(space.decode(point)) == segments
    for corner in (np.zeros(space.size), np.ones(space.size)):
        predictor.commands(predictor.draw(space.decode(corner), 12.0))  # within travel and time, or it would raise
