"""PX4's messages, built from their definitions; the truth is what those definitions say of axes, units and times."""

import math

import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg

from sysid_node.flight.autopilots.base import AdapterSettings
from sysid_node.flight.autopilots.px4 import AIR, AIRSPEED, ATTITUDE, IMU, MOTORS, SERVOS, Px4
from sysid_node.flight.frames import quaternion_from_euler

JOINTS = "elevator=servo2:0.1:-0.4 throttle=motor1:0:1"
FORCE, RATES = np.array([0.5, -0.25, -9.75], np.float32), np.array([0.5, 0.25, -0.125], np.float32)


@pytest.fixture
def px4() -> Px4:
    return Px4(AdapterSettings(joints=JOINTS, air_data_delay=0.02))


def imu(make, stamp_us: int = 5_000_000, relative: int = 0):
    fields = {"gyro_rad": RATES, "accelerometer_m_s2": FORCE, "accelerometer_timestamp_relative": relative}
    return make(Px4.topics[IMU], timestamp=stamp_us, **fields)


def airspeed(make, source: int, stamp_us: int = 7_000_000):
    return make(Px4.topics[AIRSPEED], timestamp=stamp_us, true_airspeed_m_s=18.5, airspeed_source=source)


def test_the_imu_is_taken_as_it_is(px4, make) -> None:
    sample = px4.hear(IMU, imu(make))
    assert sample.stamp_ns == 5_000_000_000
    assert sample.force == tuple(FORCE.tolist())
    assert sample.rates == tuple(RATES.tolist())
    assert sample.attitude is None


def test_force_without_a_valid_time_is_not_measured(px4, make) -> None:
    sample = px4.hear(IMU, imu(make, relative=2**31 - 1))
    assert all(math.isnan(value) for value in sample.force)
    assert sample.rates == tuple(RATES.tolist())


def test_the_attitude_is_that_of_the_imus_time(px4, make) -> None:
    """Turned on by rate times time from its own sample; an old one is none."""
    x, y, z, w = quaternion_from_euler(np.array([[0.0, 0.0, 0.3]]), "frd")[0]
    q = np.array([w, x, y, z], np.float32)
    assert px4.hear(ATTITUDE, make(Px4.topics[ATTITUDE], timestamp=1, timestamp_sample=4_980_000, q=q)) is None
    still = make(Px4.topics[IMU], timestamp=5_000_000, gyro_rad=np.array([0, 0, 2], np.float32))
    x, y, z, w = quaternion_from_euler(np.array([[0.0, 0.0, 0.3 + 0.02 * 2.0]]), "frd")[0]
    assert px4.hear(IMU, still).attitude == pytest.approx((w, x, y, z), abs=1e-7)
    assert px4.hear(IMU, imu(make, stamp_us=5_200_000)).attitude is None


@pytest.mark.parametrize(("source", "measured"), [(-1, False), (0, False), (1, True), (3, True), (4, False)])
def test_only_a_sensors_airspeed_counts(px4, make, source: int, measured: bool) -> None:
    sample = px4.hear(AIRSPEED, airspeed(make, source))
    assert sample.stamp_ns == 6_980_000_000, "less the delay"
    assert sample.true_airspeed == 18.5 if measured else math.isnan(sample.true_airspeed)
    assert all(math.isnan(value) for value in (sample.angle_of_attack, sample.sideslip, sample.air_density))


def test_airspeed_of_older_firmware(px4, store) -> None:
    """Until 1.15 the source had another name."""
    kind = "px4_msgs/msg/OlderAirspeedValidated"
    text = "uint64 timestamp\nfloat32 true_airspeed_m_s\nbool airspeed_sensor_measurement_valid\n"
    store.register(get_types_from_msg(text + "int8 selected_airspeed_index\n", kind))
    older = store.types[kind]
    assert px4.hear(AIRSPEED, older(1, 18.5, True, 1)).true_airspeed == 18.5
    assert math.isnan(px4.hear(AIRSPEED, older(1, 18.5, True, 0)).true_airspeed)


def test_density_is_held(px4, make) -> None:
    assert px4.hear(AIR, make(Px4.topics[AIR], timestamp=1, rho=1.125)) is None
    assert px4.hear(AIRSPEED, airspeed(make, 1)).air_density == 1.125


def test_outputs_become_joints(px4, make) -> None:
    """Scale times output less trim; what was not heard, and what is disarmed, is NaN."""
    servos = np.full(8, np.nan, np.float32)
    servos[1] = 0.5
    message = make(Px4.topics[SERVOS], timestamp=8_000_000, control=servos)
    sample = px4.hear(SERVOS, message)
    assert (sample.stamp_ns, sample.names) == (8_000_000_000, ("elevator", "throttle"))
    assert sample.positions[0] == pytest.approx(-0.16)
    assert math.isnan(sample.positions[1])
    assert px4.hear(MOTORS, make(Px4.topics[MOTORS], control=np.full(12, 0.75, np.float32))) is None
    assert px4.hear(SERVOS, message).positions[1] == 0.75
    disarmed = make(Px4.topics[SERVOS], control=np.full(8, np.nan, np.float32))
    assert math.isnan(px4.hear(SERVOS, disarmed).positions[0])
