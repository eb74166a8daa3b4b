"""Messages to numbers and back: stamps, estimates."""

import math

import pytest
from harness import START_NS
from rclpy.serialization import deserialize_message
from sysid_msgs.msg import DerivativeEstimates

from sysid_node.online.estimates.serialisation import EstimatesSerialiser
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.ros.support import conversion
from sysid_node.ros.support.message_types import fields_of


@pytest.mark.parametrize("nanoseconds", [0, 1, 999_999_999, 10**9, START_NS + 123])
def test_stamps_survive(nanoseconds: int) -> None:
    assert conversion.stamp_ns(conversion.stamp_message(nanoseconds)) == nanoseconds


def test_estimates_survive_to_the_last_bit() -> None:
    estimates = Estimates(
        0.1,
        {
            "Cm_alpha": DerivativeEstimate("Cm_alpha", -1 / 3, 0.1, -0.5, -0.1, True, "ok", 0.08, 0.06),
            "Cm_q": DerivativeEstimate(
                "Cm_q", -2 / 3, math.inf, -math.inf, math.inf, False, "not excited", math.inf, 0.0
            ),
        },
        {"Cm": FitQuality("Cm", 0.9, 1e-3, 7.5, 12)},
        {"elevator": DerivativeEstimate("elevator", 0.03, 0.002, 0.026, 0.034, True, "ok", 0.002, 0.0)},
    )
    raw = EstimatesSerialiser(fields_of, "cdrw", "sls_rft").one(estimates, START_NS + 100_000_000, "base_link")
    message = deserialize_message(raw, DerivativeEstimates)
    assert (message.header.frame_id, message.aircraft, message.method) == ("base_link", "cdrw", "sls_rft")
    assert conversion.estimates_from_message(message, START_NS) == estimates
