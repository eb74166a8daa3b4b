"""Messages to numbers and back: frames, stamps, estimates."""

import math

import pytest
from geometry_msgs.msg import Vector3
from harness import START_NS
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu
from sysid_msgs.msg import DerivativeEstimates

from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.ros import conversion
from sysid_node.ros.estimates_cdr import EstimatesSerialiser
from sysid_node.ros.message_types import RosTypes


def test_level_flight_in_either_frame() -> None:
    """At rest an accelerometer reads +g upwards: (0, 0, 9.8) FLU, (0, 0, -9.8) FRD (REP-103). Nose up: q > 0 in FRD."""
    flu = Imu(linear_acceleration=Vector3(z=9.8), angular_velocity=Vector3(x=0.1, y=-0.2, z=-0.3))
    frd = Imu(linear_acceleration=Vector3(z=-9.8), angular_velocity=Vector3(x=0.1, y=0.2, z=0.3))
    expected = (0.0, 0.0, -9.8, 0.1, 0.2, 0.3)
    assert conversion.imu_values(flu, conversion.axes_sign("flu")) == expected
    assert conversion.imu_values(frd, conversion.axes_sign("frd")) == expected


@pytest.mark.parametrize("nanoseconds", [0, 1, 999_999_999, 10**9, START_NS + 123])
def test_stamps_survive(nanoseconds: int) -> None:
    assert conversion.stamp_ns(conversion.stamp_message(nanoseconds)) == nanoseconds


def test_estimates_survive_to_the_last_bit() -> None:
    estimates = Estimates(
        0.1,
        {
            "Cm_alpha": DerivativeEstimate("Cm_alpha", -1 / 3, 0.1, -0.5, -0.1, True, "ok"),
            "Cm_q": DerivativeEstimate("Cm_q", -2 / 3, math.inf, -math.inf, math.inf, False, "not excited"),
        },
        {"Cm": FitQuality("Cm", 0.9, 1e-3, 7.5, 12)},
    )
    raw = EstimatesSerialiser(RosTypes(), "cdrw", "sls_rft").one(estimates, START_NS + 100_000_000, "base_link")
    message = deserialize_message(raw, DerivativeEstimates)
    assert (message.header.frame_id, message.aircraft, message.method) == ("base_link", "cdrw", "sls_rft")
    assert conversion.estimates_from_message(message, START_NS) == estimates
