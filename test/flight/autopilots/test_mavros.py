"""MAVROS's messages, built from their definitions."""

import math

import numpy as np
import pytest

from sysid_node.flight.autopilots.base import AdapterSettings
from sysid_node.flight.autopilots.mavros import AIRSPEED, ATTITUDE, IMU, OUTPUTS, PRESSURE, Mavros
from sysid_node.flight.frames import quaternion_from_euler

STAMP = 1_700_000_000_250_000_000
JOINTS = "elevator=out2:1500:0.001 throttle=out3:1000:0.001 rudder=out4:1500:-0.001"


def adapter(**settings) -> Mavros:
    return Mavros(AdapterSettings(joints=JOINTS, **settings))


def imu(make, stamp: int = STAMP, euler=(0.0, 0.0, 0.0)):
    vector, quaternion = "geometry_msgs/msg/Vector3", "geometry_msgs/msg/Quaternion"
    x, y, z, w = quaternion_from_euler(np.array([euler]), "flu")[0]
    return make(
        Mavros.topics[IMU],
        stamp,
        linear_acceleration=make(vector, x=0.5, y=0.25, z=9.75),
        angular_velocity=make(vector, x=0.5, y=-0.25, z=0.125),
        orientation=make(quaternion, x=x, y=y, z=z, w=w),
    )


def outputs(make, stamp: int, *pulses: int):
    return make(Mavros.topics[OUTPUTS], stamp, channels=np.array(pulses, np.uint16))


def test_axes_are_turned(make) -> None:
    sample = adapter().hear(IMU, imu(make))
    assert sample == (STAMP, (0.5, -0.25, -9.75), (0.5, 0.25, -0.125), None)


def test_attitude_is_turned(make) -> None:
    """Against sysid_node.flight.frames, which is tested against rotation matrices."""
    euler, mavros = (0.3, -0.2, 1.1), adapter()
    assert mavros.hear(ATTITUDE, imu(make, euler=euler)) is None
    x, y, z, w = quaternion_from_euler(np.array([euler]), "frd")[0]
    attitude = np.array(mavros.hear(IMU, imu(make)).attitude)
    np.testing.assert_allclose(np.sign(attitude[0] * w) * attitude, (w, x, y, z), atol=1e-12)


@pytest.mark.parametrize(
    ("pressure", "celsius", "density"), [(101325.0, 15.0, 1.2250), (79501.4, 2.0, 1.0066), (54048.3, -17.47, 0.7364)]
)
def test_true_airspeed_in_the_standard_atmosphere(make, pressure: float, celsius: float, density: float) -> None:
    """Pressures, temperatures and densities of the ICAO standard atmosphere at 0, 2000 and 5000 m."""
    mavros = adapter(air_temperature=celsius)
    air = make(Mavros.topics[PRESSURE], STAMP, fluid_pressure=pressure)
    assert mavros.hear(PRESSURE, air) is None
    sample = mavros.hear(AIRSPEED, make(Mavros.topics[AIRSPEED], STAMP, airspeed=20.0))
    assert sample.air_density == pytest.approx(density, rel=2e-4)
    assert sample.true_airspeed == pytest.approx(20.0 * math.sqrt(1.225 / density), rel=1e-4)


def test_without_a_pressure_there_is_no_true_airspeed(make) -> None:
    mavros = adapter()
    hud = make(Mavros.topics[AIRSPEED], STAMP, airspeed=20.0)
    assert math.isnan(mavros.hear(AIRSPEED, hud).true_airspeed)
    mavros.hear(PRESSURE, make(Mavros.topics[PRESSURE], STAMP, fluid_pressure=0.0))
    assert math.isnan(mavros.hear(AIRSPEED, hud).true_airspeed)


def test_pulses_become_joints(make) -> None:
    """An output of 0 or 65535 is not used, one that is missing was never sent."""
    mavros = adapter()
    sample = mavros.hear(OUTPUTS, outputs(make, STAMP, 1500, 1600, 1250, 1400))
    assert (sample.stamp_ns, sample.names) == (STAMP, ("elevator", "throttle", "rudder"))
    assert sample.positions == pytest.approx((0.1, 0.25, 0.1))
    none = mavros.hear(OUTPUTS, outputs(make, STAMP, 1500, 0, 65535)).positions
    assert all(math.isnan(position) for position in none)


@pytest.mark.parametrize("wraps", [0, 1, 3])
def test_the_32_bit_counter_of_outputs_is_unwrapped(make, wraps: int) -> None:
    """SERVO_OUTPUT_RAW.time_usec: its stamp falls behind by 2^32 us at each wrap."""
    mavros = adapter()
    mavros.hear(IMU, imu(make))
    behind = STAMP + 20_000_000 - wraps * 2**32 * 1000
    assert mavros.hear(OUTPUTS, outputs(make, behind, *[1500] * 4)).stamp_ns == STAMP + 20_000_000
