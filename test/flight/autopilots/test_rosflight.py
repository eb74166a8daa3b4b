"""ROSflight's messages, built from their definitions."""

import math

import numpy as np
import pytest

from sysid_node.flight.autopilots.base import AdapterSettings
from sysid_node.flight.autopilots.rosflight import AIRSPEED, ATTITUDE, IMU, OUTPUTS, PRESSURE, Rosflight
from sysid_node.flight.frames import quaternion_from_euler

STAMP = 1_700_000_000_250_000_000


@pytest.fixture
def rosflight() -> Rosflight:
    return Rosflight(AdapterSettings(joints="elevator=out2:0:0.35 throttle=out5:0:1"))


def test_axes_stay_and_the_stamped_attitude_is_taken(rosflight, make) -> None:
    vector = "geometry_msgs/msg/Vector3"
    x, y, z, w = quaternion_from_euler(np.array([[0.3, -0.2, 1.1]]), "frd")[0]
    attitude = make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
    assert rosflight.hear(ATTITUDE, make(Rosflight.topics[ATTITUDE], STAMP, attitude=attitude)) is None
    sample = rosflight.hear(
        IMU, make(Rosflight.topics[IMU], STAMP, linear_acceleration=make(vector, x=0.5, y=-0.25, z=-9.75))
    )
    assert sample[:3] == (STAMP, (0.5, -0.25, -9.75), (0.0, 0.0, 0.0))
    assert sample.attitude == pytest.approx((w, x, y, z), abs=1e-12)


def test_airspeed_from_the_pressures(rosflight, make) -> None:
    """Bernoulli: 245 Pa are 20 m/s at 1.225 kg/m^3; the message's own velocity is not used."""
    message = make(Rosflight.topics[AIRSPEED], STAMP, differential_pressure=245.0, velocity=99.0)
    assert math.isnan(rosflight.hear(AIRSPEED, message).true_airspeed), "no density yet"
    rosflight.hear(PRESSURE, make(Rosflight.topics[PRESSURE], STAMP, pressure=101325.0, temperature=310.0))
    sample = rosflight.hear(AIRSPEED, message)
    assert (sample.true_airspeed, sample.air_density) == pytest.approx((20.0, 1.225), rel=1e-5)
    negative = make(Rosflight.topics[AIRSPEED], STAMP, differential_pressure=-3.0)
    assert rosflight.hear(AIRSPEED, negative).true_airspeed == 0.0


def test_outputs_become_joints(rosflight, make) -> None:
    values = np.zeros(14, np.float32)
    values[[1, 4]] = -0.5, 0.75
    sample = rosflight.hear(OUTPUTS, make(Rosflight.topics[OUTPUTS], STAMP, values=values))
    assert sample == (STAMP, ("elevator", "throttle"), (-0.175, 0.75))
