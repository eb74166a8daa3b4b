"""Messages to numbers and back: stamps, estimates."""

import math

import numpy as np
import pytest
from harness import START_NS
from rclpy.serialization import deserialize_message, serialize_message
from sysid_msgs.msg import DerivativeEstimates, EstimateCorrelation, ModelGap

from sysid_node.online.estimates.covariance import EstimateCovariance
from sysid_node.online.estimates.model_gap import CoefficientGap
from sysid_node.online.estimates.serialisation import EstimatesSerialiser
from sysid_node.online.estimates.servo_gap import ServoGap
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


def test_gaps_of_servos_stand_in_the_message_of_the_gap() -> None:
    gaps = [CoefficientGap("Cm", 0.02, 0.01, 0.3, "Cm_q", 2.5)]
    servos = [ServoGap("elevator", 0.05, 0.004, 0.03), ServoGap("rudder", 0.06, 0.005, math.nan)]
    raw = serialize_message(conversion.gap_message(gaps, servos, conversion.header(START_NS, "imu"), "cdrw"))
    message = deserialize_message(raw, ModelGap)
    assert list(message.servos) == ["elevator", "rudder"]
    assert list(message.servo_time) == [0.05, 0.06]
    assert list(message.servo_time_error) == [0.004, 0.005]
    assert message.servo_time_in_file[0] == 0.03
    assert math.isnan(message.servo_time_in_file[1])
    assert list(message.gap_std) == [0.02]


def test_correlations_survive_without_names_that_are_not_known() -> None:
    matrix = np.array([[1.0, 0.5, -0.25], [0.5, 1.0, 0.125], [-0.25, 0.125, 1.0]])
    covariance = EstimateCovariance(("Cm_de", "foreign", "Cm_q"), 4.0 * matrix, np.zeros((3, 3)))
    raw = serialize_message(conversion.correlation_message(covariance, conversion.header(START_NS, "imu"), "cdrw"))
    message = deserialize_message(raw, EstimateCorrelation)
    assert (message.aircraft, message.header.frame_id, len(message.correlation)) == ("cdrw", "imu", 9)
    found = conversion.correlation_from_message(message, {"Cm_q", "Cm_de"})
    assert found.names == ("Cm_de", "Cm_q")
    np.testing.assert_array_equal(found.matrix, [[1.0, -0.25], [-0.25, 1.0]])


def test_a_message_without_a_number_for_each_pair_of_names_holds_no_correlation() -> None:
    message = EstimateCorrelation(names=["Cm_de", "Cm_q"], correlation=[1.0, 0.5, 1.0])
    assert conversion.correlation_from_message(message, {"Cm_q", "Cm_de"}).matrix.size == 0
