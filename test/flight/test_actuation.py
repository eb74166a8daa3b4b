"""Joints to controls: the aircraft file's linear map."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_flights import JOINTS, made_aircraft

from sysid_node.errors import InputError
from sysid_node.flight.actuation import Actuation

MAP = Actuation.of(made_aircraft())
positions = st.one_of(st.floats(), st.floats(-1.6, 1.6), st.sampled_from([math.nan, math.inf, 1.5, math.pi / 2]))


def message(names, values):
    return MAP.of_message(MAP.places(names), values)


def test_controls_are_offset_plus_scaled_joints():
    # throttle, elevator, left, right, rudder, flap
    values = message(JOINTS, (0.5, 0.1, 0.2, -0.3, 0.04, 9.9))
    expected = (15.0, 0.013 + 1.1 * 0.1, -0.45 * 0.2 + 0.55 * -0.3, -0.007 - 0.04)
    assert values == pytest.approx(expected, rel=1e-15)


def test_order_of_joints_does_not_matter_and_others_are_ignored():
    assert message(JOINTS[::-1], (9.9, 0.04, -0.3, 0.2, 0.1, 0.5)) == message(JOINTS, (0.5, 0.1, 0.2, -0.3, 0.04, 9.9))


def test_of_a_joint_given_twice_the_first_counts():
    twice = message(("elevator", *JOINTS), (0.1, 0.5, 0.3, 0.0, 0.0, 0.0, 0.0))
    assert twice == message(JOINTS, (0.5, 0.1, 0.0, 0.0, 0.0, 0.0))


def test_no_throttle_joint_leaves_thrust_unknown():
    thrust, *controls = message(JOINTS[1:], (0.1, 0.2, -0.3, 0.04, 0.0))
    assert math.isnan(thrust)
    assert all(map(math.isfinite, controls))


@pytest.mark.parametrize("values", [(0.5, 0.1, 0.2, -0.3), ()])
def test_fewer_positions_than_names_is_a_fault(values):
    assert "missing" in message(JOINTS, values)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(*[positions] * len(JOINTS)), min_size=1, max_size=6))
def test_in_bulk_as_one_by_one_to_the_last_bit(rows):
    values, faults = MAP.of_array(JOINTS, np.array(rows))
    for row, value, fault in zip(rows, values, faults, strict=True):
        one = message(JOINTS, row)
        if isinstance(one, str):
            assert fault == one
        else:
            assert fault is None
            assert np.array(one).tobytes() == value.tobytes() or (math.isnan(one[0]) and math.isnan(value[0]))


def test_unknown_joints_are_named_with_those_present():
    MAP.require(JOINTS, "bag x")
    with pytest.raises(InputError, match=r"bag x: .*'left', 'right'; they have 'elevator', 'servo_3'"):
        MAP.require(("elevator", "servo_3", "rudder"), "bag x")
    with pytest.raises(InputError, match="they have none"):
        MAP.require((), "bag x")


def test_of_very_many_joints_the_first_are_named():
    many = [f"servo_{i}" for i in range(3000)]
    with pytest.raises(InputError, match=r"'servo_11' and 2988 more; name them so") as caught:
        MAP.require(many, "bag x")
    assert len(str(caught.value)) < 400
