"""Set-points: known names only, forgotten when they expire. Those of pitch rate move the pitch within its limits."""

import math

import numpy as np
import pytest
from flying import AIRCRAFT, level
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid_node.control import controller
from sysid_node.control.inputs.set_point_input import SetPointInput
from sysid_node.control.law.reference import set_point_limits
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import SetPoints

STEP = 0.02  # s


def test_set_points_expire() -> None:
    source = SetPointInput(expire_after=2.0)
    assert not source.expired(100.0), "none has come"
    assert source.receive(100.0, {"roll": 0.2, "pitch_rate": 0.1}) == []
    assert source.current(101.9).roll == 0.2
    assert source.expired(102.1)
    assert all(map(math.isnan, source.current(102.1)))
    source.receive(103.0, {"roll": 0.1})
    assert source.current(103.0)[:2] == pytest.approx((0.1, math.nan), nan_ok=True)
    assert not source.expired(103.0)


def test_what_is_wrong_with_set_points_is_said() -> None:
    source = SetPointInput(expire_after=2.0)
    wrong = source.receive(0.0, {"rol": 0.2, "pitch": 0.1, "flaps": 1.0, "airspeed": math.inf, "sideslip": math.nan})
    assert [line.partition(": left out")[0] for line in wrong] == [
        "set-point 'rol' is not known",
        "set-point 'flaps' is not known",
        "set-point 'airspeed' is infinite",
    ]
    assert "did you mean 'roll'?" in wrong[0]
    assert source.current(0.0).pitch == 0.1
    assert math.isnan(source.current(0.0).airspeed)


@pytest.mark.parametrize("rate", [0.2, -1e6])
def test_a_pitch_rate_stops_at_the_largest_pitch(rate: float) -> None:
    """Held for 10 s. The aircraft is at the reference all the while; before, the reference went on to 4.7 rad."""
    state = controller.init(AIRCRAFT, ControllerSettings(largest_pitch=0.4))
    measured, pitches = level(0.0), []
    for k in range(500):
        controller.step(state, measured, SetPoints(pitch_rate=rate))
        wanted = state.law.wanted
        assert wanted is not None
        measured = level((k + 1) * STEP, theta=wanted.theta, q=wanted.q)
        pitches.append(wanted.theta)
    assert np.abs(pitches).max() <= 0.4 + 1e-9
    assert pitches[-1] == pytest.approx(math.copysign(0.4, rate), abs=0.02)
    assert wanted.q == pytest.approx(0.0, abs=0.01)


ANY = st.floats(allow_nan=True, allow_infinity=True)


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(points=st.lists(st.builds(SetPoints, ANY, ANY, ANY, ANY, ANY), min_size=1, max_size=6), w=st.floats(0.2, 20.0))
def test_whatever_is_asked_for_the_reference_keeps_its_limits(points: list[SetPoints], w: float) -> None:
    state = controller.init(AIRCRAFT, ControllerSettings(bandwidth=w))
    for k in range(60):
        controller.step(state, level(k * STEP), points[k * len(points) // 60])
        wanted = state.law.wanted
        assert wanted is not None
        assert abs(wanted.theta) <= 0.4 + 1e-9
        assert abs(wanted.phi) <= 0.8 + 1e-9
        assert abs(wanted.beta) <= 0.15 + 1e-9


def test_what_is_beyond_its_limits_is_said() -> None:
    given = SetPointInput(2.0, set_point_limits(20.0, ControllerSettings()))
    assert given.receive(0.0, {"roll": 0.8, "pitch": -0.4, "airspeed": 28.0, "pitch_rate": float("nan")}) == []
    assert given.receive(0.0, {"roll": -20.0, "airspeed": 40.0}) == [
        "set-point 'roll' of -20 rad is beyond -0.8 to 0.8 rad: the limit is flown",
        "set-point 'airspeed' of 40 m/s is beyond 15 to 28 m/s: the limit is flown",
    ]
