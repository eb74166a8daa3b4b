"""Autopilots' messages from their own definitions, encoded and decoded as in a bag. No ROS.

The definitions are copied, without most comments, from msg/ and msg/versioned/ of github.com/PX4/PX4-Autopilot
(BSD-3-Clause; px4_msgs is made of them), mavros_msgs/msg of github.com/mavlink/mavros (BSD, LGPL-3.0 or GPL-3.0) and
rosflight_msgs/msg of github.com/rosflight/rosflight_ros_pkgs (BSD-3-Clause).
"""

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import get_types_from_msg
from rosbags.typesys.store import Typestore

from sysid_node.flight.bag.message_types import type_store

DEFINITIONS = {
    "px4_msgs/msg/SensorCombined": """
        uint64 timestamp
        int32 RELATIVE_TIMESTAMP_INVALID = 2147483647
        float32[3] gyro_rad  # FRD body frame, rad/s
        uint32 gyro_integral_dt
        int32 accelerometer_timestamp_relative  # timestamp + this = accelerometer timestamp
        float32[3] accelerometer_m_s2  # FRD body frame, m/s^2
        uint32 accelerometer_integral_dt
        uint8 CLIPPING_X = 1
        uint8 CLIPPING_Y = 2
        uint8 CLIPPING_Z = 4
        uint8 accelerometer_clipping
        uint8 gyro_clipping
        uint8 accel_calibration_count
        uint8 gyro_calibration_count
    """,
    "px4_msgs/msg/VehicleAttitude": """
        uint64 timestamp
        uint64 timestamp_sample
        float32[4] q  # from the FRD body frame to the NED earth frame, w first
        float32[4] delta_q_reset
        uint8 quat_reset_counter
    """,
    "px4_msgs/msg/AirspeedValidated": """
        uint32 MESSAGE_VERSION = 1
        uint64 timestamp
        float32 indicated_airspeed_m_s
        float32 calibrated_airspeed_m_s
        float32 true_airspeed_m_s
        int8 airspeed_source
        int8 SOURCE_DISABLED = -1
        int8 SOURCE_GROUND_MINUS_WIND = 0
        int8 SOURCE_SENSOR_1 = 1
        int8 SOURCE_SENSOR_2 = 2
        int8 SOURCE_SENSOR_3 = 3
        int8 SOURCE_SYNTHETIC = 4
        float32 calibrated_ground_minus_wind_m_s
        float32 calibraded_airspeed_synth_m_s
        float32 airspeed_derivative_filtered
        float32 throttle_filtered
        float32 pitch_filtered
    """,
    "px4_msgs/msg/VehicleAirData": """
        uint64 timestamp
        uint64 timestamp_sample
        uint32 baro_device_id
        float32 baro_alt_meter
        float32 baro_pressure_pa
        float32 ambient_temperature
        uint8 temperature_source
        float32 rho
        uint8 calibration_count
    """,
    "px4_msgs/msg/ActuatorServos": """
        uint32 MESSAGE_VERSION = 0
        uint64 timestamp
        uint64 timestamp_sample
        uint8 NUM_CONTROLS = 8
        float32[8] control  # -1 to 1, NaN = disarmed
    """,
    "px4_msgs/msg/ActuatorMotors": """
        uint32 MESSAGE_VERSION = 0
        uint64 timestamp
        uint64 timestamp_sample
        uint16 reversible_flags
        uint8 ACTUATOR_FUNCTION_MOTOR1 = 101
        uint8 NUM_CONTROLS = 12
        float32[12] control  # -1 to 1, NaN = disarmed
    """,
    "mavros_msgs/msg/VfrHud": """
        std_msgs/Header header
        float32 airspeed  # m/s
        float32 groundspeed  # m/s
        int16 heading
        float32 throttle
        float32 altitude
        float32 climb
    """,
    "mavros_msgs/msg/RCOut": """
        std_msgs/Header header
        uint16[] channels
    """,
    "rosflight_msgs/msg/Attitude": """
        std_msgs/Header header
        geometry_msgs/Quaternion attitude
        geometry_msgs/Vector3 angular_velocity
    """,
    "rosflight_msgs/msg/Airspeed": """
        std_msgs/Header header
        float32 velocity  # m/s
        float32 differential_pressure  # Pa
        float32 temperature  # K
    """,
    "rosflight_msgs/msg/Barometer": """
        std_msgs/Header header
        float32 altitude
        float32 pressure
        float32 temperature
    """,
    "rosflight_msgs/msg/OutputRaw": """
        std_msgs/Header header
        float32[14] values
    """,
}

Make = Callable[..., Any]


@pytest.fixture(scope="session")
def store() -> Typestore:
    """ROS's types, ours and the autopilots'."""
    types = deepcopy(type_store())
    for kind, text in DEFINITIONS.items():
        types.register(get_types_from_msg("\n".join(line.strip() for line in text.splitlines()), kind))
    return types


@pytest.fixture(scope="session")
def make(store: Typestore) -> Make:
    """``make(kind, **fields)``: a message that has been through its bytes; other fields zero, ``stamp`` in ns."""

    def build(kind: str, fields: dict[str, Any]) -> Any:
        given = {name: fields.get(name, zero(node)) for name, node in store.fielddefs[kind][1]}
        return store.types[kind](**given)

    def zero(node: Any) -> Any:
        kind, detail = node
        if kind == Nodetype.NAME:
            return build(detail, {})
        if kind == Nodetype.BASE:
            return "" if detail[0] == "string" else 0
        (_, (base, _)), length = detail
        return np.zeros(length, base)

    def make(kind: str, stamp: int = 0, **fields: Any) -> Any:
        if stamp:
            time = build("builtin_interfaces/msg/Time", {"sec": stamp // 10**9, "nanosec": stamp % 10**9})
            fields["header"] = build("std_msgs/msg/Header", {"stamp": time})
        return store.deserialize_cdr(store.serialize_cdr(build(kind, fields), kind), kind)

    return make
