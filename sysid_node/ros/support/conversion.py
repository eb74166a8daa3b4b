"""Conversion between ROS messages and the values of the layers below: SI, radians, body axes forward-right-down."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from builtin_interfaces.msg import Time
from std_msgs.msg import Header
from sysid_msgs.msg import EstimateCorrelation, ModelGap

from sysid_node.control.types import ErrorCorrelation
from sysid_node.online import types
from sysid_node.online.types import Estimates

if TYPE_CHECKING:  # these modules load SciPy, without which a node that only converts messages starts sooner
    from sysid_node.online.estimates.covariance import EstimateCovariance
    from sysid_node.online.estimates.model_gap import CoefficientGap
    from sysid_node.online.estimates.servo_gap import ServoGap

NANOSECONDS = 1_000_000_000


def stamp_ns(stamp: Time) -> int:
    """Nanoseconds of a stamp."""
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def stamp_message(nanoseconds: int) -> Time:
    """The stamp of nanoseconds."""
    seconds, rest = divmod(nanoseconds, NANOSECONDS)
    return Time(sec=seconds, nanosec=rest)


def header(nanoseconds: int, frame_id: str) -> Header:
    """A header with a stamp (ns)."""
    return Header(stamp=stamp_message(nanoseconds), frame_id=frame_id)


def gap_message(gaps: Sequence[CoefficientGap], servos: Sequence[ServoGap], header: Header, aircraft: str) -> ModelGap:
    """The message of the gaps of all coefficients and servos."""
    return ModelGap(
        header=header,
        aircraft=aircraft,
        coefficients=[gap.coefficient for gap in gaps],
        gap_std=[gap.gap_std for gap in gaps],
        noise_std=[gap.noise_std for gap in gaps],
        relative=[gap.relative for gap in gaps],
        derivatives=[gap.derivative for gap in gaps],
        deviation=[gap.deviation for gap in gaps],
        servos=[servo.control for servo in servos],
        servo_time=[servo.time for servo in servos],
        servo_time_error=[servo.standard_error for servo in servos],
        servo_time_in_file=[servo.in_file for servo in servos],
    )


def correlation_message(covariance: EstimateCovariance, header: Header, aircraft: str) -> EstimateCorrelation:
    """The message of how the errors of all derivatives go together."""
    names, matrix = covariance.correlation()
    return EstimateCorrelation(header=header, aircraft=aircraft, names=list(names), correlation=matrix.ravel())


def correlation_from_message(message: Any, known: Collection[str]) -> ErrorCorrelation:
    """The correlation in a sysid_msgs/EstimateCorrelation of the ``known`` derivatives among its names.

    It is empty, with names, where the message does not hold a number for each pair of names.
    """
    places = {name: i for i, name in enumerate(message.names) if name in known}
    numbers, count = np.asarray(message.correlation, np.float64), len(message.names)
    if numbers.size != count * count:
        return ErrorCorrelation(tuple(places), np.zeros((0, 0)))
    chosen = list(places.values())
    return ErrorCorrelation(tuple(places), numbers.reshape(count, count)[np.ix_(chosen, chosen)])


def estimates_from_message(message: Any, start_ns: int) -> Estimates:
    """The estimates in a sysid_msgs/DerivativeEstimates; ``time`` is in s from ``start_ns``."""
    return Estimates(
        time=(stamp_ns(message.header.stamp) - start_ns) / NANOSECONDS,
        derivatives={d.name: _estimate(d) for d in message.derivatives},
        fits={
            f.coefficient: types.FitQuality(f.coefficient, f.r_squared, f.residual_std, f.degrees_of_freedom, f.samples)
            for f in message.fits
        },
        servos={d.name: _estimate(d) for d in message.servos},
    )


def _estimate(d: Any) -> types.DerivativeEstimate:
    """The estimate in a sysid_msgs/DerivativeEstimate."""
    parts = d.statistical_error, d.systematic_error
    return types.DerivativeEstimate(d.name, d.value, d.standard_error, d.lower, d.upper, d.valid, d.status, *parts)
