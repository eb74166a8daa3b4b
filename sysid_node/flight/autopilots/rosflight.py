"""ROSflight through rosflight_io (package rosflight_msgs). Axes are forward-right-down and north-east-down."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Any

from sysid_node.flight.autopilots.attitude import attitude_of
from sysid_node.flight.autopilots.base import AirSample, ImuSample, JointSample, header_ns, numbered
from sysid_node.flight.autopilots.five_topics import FiveTopics

IMU = "/imu/data"
ATTITUDE = "/attitude"
PRESSURE = "/baro"
AIRSPEED = "/airspeed"
OUTPUTS = "/output_raw"


class Rosflight(FiveTopics):
    """ROSflight 2, whose firmware streams OutputRaw, Airspeed and Barometer."""

    parts = IMU, ATTITUDE, PRESSURE, AIRSPEED, OUTPUTS
    essential = IMU, AIRSPEED, OUTPUTS
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

    def _imu(self, message: Any) -> ImuSample:
        """A sample with the stamped attitude of another topic.

        The message's own orientation is older and has no stamp.
        """
        stamp_ns = header_ns(message)
        force, rate = message.linear_acceleration, message.angular_velocity
        rates = (float(rate.x), float(rate.y), float(rate.z))
        attitude = self.attitude.at(stamp_ns, rates)
        return ImuSample(stamp_ns, (float(force.x), float(force.y), float(force.z)), rates, attitude)

    def _attitude(self, message: Any) -> None:
        self.attitude.heard(header_ns(message), attitude_of(message.attitude))

    def _pressure(self, message: Any) -> None:
        self.air_density = self.density(float(message.pressure))

    def _joints(self, message: Any) -> JointSample:
        return self.deflections(header_ns(message), numbered("out", message.values))

    def _air(self, message: Any) -> AirSample:
        """Air data by Bernoulli's equation, 0.2 % high at 40 m/s.

        The firmware's velocity depends on its probe's temperature.
        """
        pressure = max(float(message.differential_pressure), 0.0)
        return self.air(header_ns(message), math.sqrt(2.0 * pressure / self.air_density), self.air_density)
