"""ROSflight, through rosflight_io: package rosflight_msgs. Axes are forward-right-down and north-east-down."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Any

from sysid_node.ros.adapters.attitude import LastAttitude, attitude_of
from sysid_node.ros.adapters.base import (
    Adapter,
    AirSample,
    ImuSample,
    Sample,
    Settings,
    header_ns,
    numbered,
)

IMU = "/imu/data"
ATTITUDE = "/attitude"
PRESSURE = "/baro"
AIRSPEED = "/airspeed"
OUTPUTS = "/output_raw"


class Rosflight(Adapter):
    """ROSflight 2, whose firmware streams OutputRaw, Airspeed and Barometer."""

    topics = MappingProxyType(
        {
            IMU: "sensor_msgs/msg/Imu",
            ATTITUDE: "rosflight_msgs/msg/Attitude",
            PRESSURE: "rosflight_msgs/msg/Barometer",
            AIRSPEED: "rosflight_msgs/msg/Airspeed",
            OUTPUTS: "rosflight_msgs/msg/OutputRaw",
        }
    )
    outputs = tuple(f"out{i}" for i in range(1, 15))
    example = "aileron=out1:0:0.35 elevator=out2:0:0.35 rudder=out3:0:0.35 throttle=out5:0:1"
    package = "rosflight_msgs"
    remedy = "build github.com/rosflight/rosflight_ros_pkgs, and source that workspace"

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        self._attitude = LastAttitude()
        self._density = math.nan

    def hear(self, topic: str, message: Any) -> Sample | None:
        """See ``Adapter``. The pressure is held until the next; without one there is no true airspeed."""
        stamp_ns = header_ns(message)
        if topic == IMU:
            return self._imu(stamp_ns, message)
        if topic == AIRSPEED:
            return self._air(stamp_ns, message)
        if topic == OUTPUTS:
            return self.deflections(stamp_ns, numbered("out", message.values))
        if topic == ATTITUDE:
            self._attitude.heard(stamp_ns, attitude_of(message.attitude))
        elif topic == PRESSURE:
            self._density = self.density(float(message.pressure))
        return None

    def _imu(self, stamp_ns: int, message: Any) -> ImuSample:
        """Its own orientation is an older attitude without a time; the stamped one is taken."""
        force, rate = message.linear_acceleration, message.angular_velocity
        rates = (float(rate.x), float(rate.y), float(rate.z))
        attitude = self._attitude.at(stamp_ns, rates)
        return ImuSample(stamp_ns, (float(force.x), float(force.y), float(force.z)), rates, attitude)

    def _air(self, stamp_ns: int, message: Any) -> AirSample:
        """By Bernoulli, 0.2 % high at 40 m/s; the firmware's own velocity depends on its probe's temperature."""
        pressure = max(float(message.differential_pressure), 0.0)
        return self.air(stamp_ns, math.sqrt(2.0 * pressure / self._density), self._density)
