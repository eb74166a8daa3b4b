"""PX4 through its uXRCE-DDS bridge (package px4_msgs). Axes are forward-right-down, stamps are in microseconds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from sysid_node.flight.autopilots.attitude import Attitude, normalised
from sysid_node.flight.autopilots.base import (
    Adapter,
    AdapterSettings,
    AirSample,
    ImuSample,
    JointSample,
    Sample,
    numbered,
)

IMU = "/fmu/out/sensor_combined"
ATTITUDE = "/fmu/out/vehicle_attitude"
AIRSPEED = "/fmu/out/airspeed_validated"
AIR = "/fmu/out/vehicle_air_data"
SERVOS = "/fmu/out/actuator_servos"
MOTORS = "/fmu/out/actuator_motors"


class Px4(Adapter):
    """PX4 from 1.14 on."""

    topics = MappingProxyType(
        {
            IMU: "px4_msgs/msg/SensorCombined",
            ATTITUDE: "px4_msgs/msg/VehicleAttitude",
            AIRSPEED: "px4_msgs/msg/AirspeedValidated",
            AIR: "px4_msgs/msg/VehicleAirData",
            SERVOS: "px4_msgs/msg/ActuatorServos",
            MOTORS: "px4_msgs/msg/ActuatorMotors",
        }
    )
    essential = IMU, AIRSPEED, SERVOS
    outputs = (*(f"servo{i}" for i in range(1, 9)), *(f"motor{i}" for i in range(1, 13)))
    example = "aileron=servo1:0:0.44 elevator=servo2:0:0.44 rudder=servo3:0:0.44 throttle=motor1:0:1"
    package = "px4_msgs"
    remedy = "build github.com/PX4/px4_msgs at your firmware's release, and source that workspace"

    def __init__(self, settings: AdapterSettings) -> None:
        super().__init__(settings)
        self._last_motors: dict[str, float] = {}

    def listeners(self) -> Mapping[str, Callable[[Any], Sample | None]]:
        """See ``Adapter``."""
        return {
            IMU: self._imu,
            ATTITUDE: self._attitude,
            AIR: self._density,
            AIRSPEED: self._air,
            SERVOS: self._servos,
            MOTORS: self._motors,
        }

    def _imu(self, message: Any) -> ImuSample:
        """A sample stamped when the rates were measured; without force where the accelerometer's time is invalid."""
        rx, ry, rz = (float(rate) for rate in message.gyro_rad)
        fx, fy, fz = (float(force) for force in message.accelerometer_m_s2)
        if message.accelerometer_timestamp_relative == message.RELATIVE_TIMESTAMP_INVALID:
            fx = fy = fz = math.nan
        rates = rx, ry, rz
        stamp_ns = _stamp_ns(message)
        return ImuSample(stamp_ns, (fx, fy, fz), rates, self.attitude.at(stamp_ns, rates))

    def _attitude(self, message: Any) -> None:
        attitude = Attitude(*(float(part) for part in message.q))
        self.attitude.heard(1000 * int(message.timestamp_sample), normalised(attitude))

    def _density(self, message: Any) -> None:
        self.air_density = float(message.rho)

    def _air(self, message: Any) -> AirSample:
        """Air data; no airspeed where it is ground speed minus wind, or synthetic, as those are not measured."""
        source = getattr(message, "airspeed_source", None)
        if source is None:  # until 1.15
            source = message.selected_airspeed_index
        measured = 1 <= source <= 3
        airspeed = float(message.true_airspeed_m_s) if measured else math.nan
        return self.air(_stamp_ns(message), airspeed, self.air_density)

    def _motors(self, message: Any) -> None:
        self._last_motors = numbered("motor", message.control)

    def _servos(self, message: Any) -> JointSample:
        """Deflections, with the motors' last commands."""
        return self.deflections(_stamp_ns(message), self._last_motors | numbered("servo", message.control))


def _stamp_ns(message: Any) -> int:
    return 1000 * int(message.timestamp)
