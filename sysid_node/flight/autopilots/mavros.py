"""ArduPilot through MAVROS (package mavros_msgs), which gives axes forward-left-up and east-north-up."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Any

from sysid_node.flight.autopilots.attitude import attitude_of, other_axes
from sysid_node.flight.autopilots.base import (
    SEA_LEVEL_DENSITY,
    AdapterSettings,
    AirSample,
    ImuSample,
    JointSample,
    header_ns,
    numbered,
)
from sysid_node.flight.autopilots.five_topics import FiveTopics

IMU = "/mavros/imu/data_raw"
ATTITUDE = "/mavros/imu/data"
PRESSURE = "/mavros/imu/static_pressure"
AIRSPEED = "/mavros/vfr_hud"
OUTPUTS = "/mavros/rc/out"

#: MAVLink's SERVO_OUTPUT_RAW counts microseconds in 32 bits.
WRAP_NS = 2**32 * 1000

#: Pulses (us) outside this range are no positions: 0 and 65535 mean that an output is not used.
PULSES = (400.0, 2600.0)


class Mavros(FiveTopics):
    """ArduPlane with MAVROS 2; from recordings also with MAVROS 1, whose topics and types have other names."""

    parts = IMU, ATTITUDE, PRESSURE, AIRSPEED, OUTPUTS
    essential = IMU, AIRSPEED, OUTPUTS
    topics = MappingProxyType(
        {
            IMU: "sensor_msgs/msg/Imu",
            ATTITUDE: "sensor_msgs/msg/Imu",
            PRESSURE: "sensor_msgs/msg/FluidPressure",
            AIRSPEED: "mavros_msgs/msg/VfrHud",
            OUTPUTS: "mavros_msgs/msg/RCOut",
        }
    )
    aliases = MappingProxyType(
        {PRESSURE: ("/mavros/imu/atm_pressure",), AIRSPEED: ("/mavros/nav_info/airspeed",)}  # MAVROS 0.x; its forks
    )
    stand_ins = MappingProxyType({IMU: ATTITUDE})
    outputs = tuple(f"out{i}" for i in range(1, 33))
    example = "aileron=out1:1500:0.001 elevator=out2:1500:0.001 throttle=out3:1000:0.001 rudder=out4:1500:0.001"
    package = "mavros_msgs"
    remedy = "apt install ros-$ROS_DISTRO-mavros-msgs, or build github.com/mavlink/mavros"

    def __init__(self, settings: AdapterSettings) -> None:
        super().__init__(settings)
        self._last_imu_ns = 0

    def _imu(self, message: Any) -> ImuSample:
        """A sample from data_raw. The topic data holds the force of an earlier message, with the attitude's stamp."""
        stamp_ns = self._last_imu_ns = header_ns(message)
        force, rate = message.linear_acceleration, message.angular_velocity
        rates = (float(rate.x), -float(rate.y), -float(rate.z))
        attitude = self.attitude.at(stamp_ns, rates)
        return ImuSample(stamp_ns, (float(force.x), -float(force.y), -float(force.z)), rates, attitude)

    def _attitude(self, message: Any) -> None:
        attitude = attitude_of(message.orientation)
        self.attitude.heard(header_ns(message), None if attitude is None else other_axes(attitude))

    def _pressure(self, message: Any) -> None:
        self.air_density = self.density(float(message.fluid_pressure))

    def _air(self, message: Any) -> AirSample:
        """Air data with the true airspeed: ArduPlane's equivalent airspeed times the root of the ratio of densities.

        A NavDataPair, which forks of MAVROS publish faster than VfrHud, has the commanded and the measured airspeed.
        """
        equivalent = message.measured if hasattr(message, "measured") else message.airspeed
        true_airspeed = float(equivalent) * math.sqrt(SEA_LEVEL_DENSITY / self.air_density)
        return self.air(header_ns(message), true_airspeed, self.air_density)

    def _joints(self, message: Any) -> JointSample:
        """Deflections.

        Their stamp is a counter that wraps every 71.6 minutes, so the wraps nearest to the IMU are added.
        """
        stamp_ns = header_ns(message)
        wraps = round((self._last_imu_ns - stamp_ns) / WRAP_NS) if self._last_imu_ns else 0
        used = {
            output: pulse
            for output, pulse in numbered("out", message.channels).items()
            if PULSES[0] <= pulse <= PULSES[1]
        }
        return self.deflections(stamp_ns + wraps * WRAP_NS, used)
