"""Plausibility: one by one and in bulk alike, and reasons that name the likely mistake."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid_node.flight import checks

#: Anything a float can be, with values about the limits made likely.
anything = st.one_of(
    st.floats(), st.sampled_from([0.4, 0.5, 1.5, math.pi / 2, 2.0, 35.0, 57.3, 300.0, 400.0, -35.0, math.nan, math.inf])
)
GOOD_AIR, GOOD_IMU = (18.0, 0.05, -0.02, 1.2), (0.5, 0.1, -9.8, 0.1, -0.2, 0.05)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(*[anything] * 6), min_size=1, max_size=8))
def test_imu_in_bulk_as_one_by_one(rows):
    assert checks.imu_faults(np.array(rows)).tolist() == [checks.imu_fault(row) for row in rows]


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(*[anything] * 4), min_size=1, max_size=8))
def test_air_data_in_bulk_as_one_by_one(rows):
    assert checks.air_data_faults(np.array(rows)).tolist() == [checks.air_data_fault(row) for row in rows]


def test_good_values_pass():
    assert checks.imu_fault(GOOD_IMU) is None
    assert checks.air_data_fault(GOOD_AIR) is None
    assert checks.air_data_fault((18.0, math.nan, math.nan, math.nan)) is None  # not measured is no fault
    assert checks.joint_fault("elevator", -0.4) is None
    assert checks.throttle_fault(math.nan, False) is None


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (checks.imu_fault((*GOOD_IMU[:3], 60.0, 0.0, 0.0)), "deg/s"),
        (checks.imu_fault((math.nan, *GOOD_IMU[1:])), "not finite"),
        (checks.imu_fault((0.0, 0.0, -980.0, 0.0, 0.0, 0.0)), "specific force"),
        (checks.air_data_fault((18.0, 3.1, 0.0, 1.2)), "angle_of_attack.*degrees"),
        (checks.air_data_fault((18.0, 0.1, -5.0, 1.2)), "sideslip.*degrees"),
        (checks.air_data_fault((18.0, 0.1, 0.0, 1013.0)), "air_density"),
        (checks.air_data_fault((math.nan, 0.1, 0.0, 1.2)), "true_airspeed not measured"),
        (checks.air_data_fault((0.0, 0.1, 0.0, 1.2)), "true_airspeed not within"),
        (checks.joint_fault("left", 12.0), "'left'.*degrees"),
        (checks.joint_fault("left", math.nan), "'left' missing"),
        (checks.throttle_fault(55.0, False), "percent"),
        (checks.throttle_fault(1e9, True), "thrust"),
    ],
)
def test_reasons_name_the_quantity_and_the_likely_mistake(fault, reason):
    assert fault is not None
    assert re.search(reason, fault)


def test_integers_of_any_size_do_not_raise():
    huge = 10**400
    assert checks.imu_fault((huge,) * 6) == checks.FORCE
    assert checks.air_data_fault((huge,) * 4) == checks.AIRSPEED
    assert checks.air_data_fault((18, huge, 0, 1)) == checks.ALPHA
    assert checks.joint_fault("x", -huge) == checks.joint_angle("x")
    assert checks.throttle_fault(huge, False) == checks.THROTTLE
