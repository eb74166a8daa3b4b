"""PX4, through its uXRCE-DDS bridge: package px4_msgs. Axes are forward-right-down, times microseconds of one clock."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Any

from sysid_node.ros.adapters.attitude import Attitude, LastAttitude, unit
from sysid_node.ros.adapters.base import Adapter, AirSample, ImuSample, JointSample, Sample, Settings, numbered

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
    outputs = (*(f"servo{i}" for i in range(1, 9)), *(f"motor{i}" for i in range(1, 13)))
    example = "aileron=servo1:0:0.44 elevator=servo2:0:0.44 rudder=servo3:0:0.44 throttle=motor1:0:1"
    package = "px4_msgs"
    remedy = "build github.com/PX4/px4_msgs at your firmware's release, and source that workspace"

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        self._attitude = LastAttitude()
        self._density = math.nan
        self._motors: dict[str, float] = {}

    def hear(self, topic: str, message: Any) -> Sample | None:
        """See ``Adapter``. Density and motors are held until the next."""
        stamp_ns = 1000 * int(message.timestamp)
        if topic == IMU:
            return self._imu(stamp_ns, message)
        if topic == AIRSPEED:
            return self._air(stamp_ns, message)
        if topic == SERVOS:
            return self._joints(stamp_ns, message)
        if topic == ATTITUDE:
            attitude = Attitude(*(float(part) for part in message.q))
            self._attitude.heard(1000 * int(message.timestamp_sample), unit(attitude))
        elif topic == AIR:
            self._density = float(message.rho)
        elif topic == MOTORS:
            self._motors = numbered("motor", message.control)
        return None

    def _imu(self, stamp_ns: int, message: Any) -> ImuSample:
        """Stamped when the rates were measured; no force where the accelerometer's time says that it is invalid."""
        rx, ry, rz = (float(rate) for rate in message.gyro_rad)
        fx, fy, fz = (float(force) for force in message.accelerometer_m_s2)
        if message.accelerometer_timestamp_relative == message.RELATIVE_TIMESTAMP_INVALID:
            fx = fy = fz = math.nan
        rates = rx, ry, rz
        return ImuSample(stamp_ns, (fx, fy, fz), rates, self._attitude.at(stamp_ns, rates))

    def _air(self, stamp_ns: int, message: Any) -> AirSample:
        """No airspeed where it is ground speed minus wind, or synthetic: those are no measurements of the air."""
        source = getattr(message, "airspeed_source", None)
        if source is None:  # until 1.15
            source = message.selected_airspeed_index
        measured = 1 <= source <= 3
        return self.air(stamp_ns, float(message.true_airspeed_m_s) if measured else math.nan, self._density)

    def _joints(self, stamp_ns: int, message: Any) -> JointSample:
        return self.deflections(stamp_ns, self._motors | numbered("servo", message.control))
