"""Writes the simulated flight as a ROS 2 bag of MAVROS's topics: forward-left-up, east-north-up, pulses in us."""

import sqlite3
from collections.abc import Collection, Iterator, Sequence
from contextlib import closing
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from scipy.spatial.transform import Rotation
from simulated_logs import FULL, MAX_THRUST, SERVOS, flight, fractions, picked, pulses_of

from sysid_node.flight.bag.message_types import type_store

#: mavros_msgs/msg of github.com/mavlink/mavros (BSD, LGPL-3.0 or GPL-3.0).
DEFINITIONS = {
    "mavros_msgs/msg/VfrHud": """std_msgs/Header header
        float32 airspeed
        float32 groundspeed
        int16 heading
        float32 throttle
        float32 altitude
        float32 climb""",
    "mavros_msgs/msg/RCOut": """std_msgs/Header header
        uint16[] channels""",
}

#: What an aircraft file states of these outputs.
OUTPUTS = " ".join(
    [
        f"aileron=out1:{SERVOS[1][3]}:{-FULL['aileron'] / 400.0:.7f}",
        f"elevator=out2:{SERVOS[2][3]}:{FULL['elevator'] / 500.0:.7f}",
        f"rudder=out4:{SERVOS[4][3]}:{-FULL['rudder'] / 600.0:.7f}",
        "throttle=out3:1000:0.001",
    ]
)
assert MAX_THRUST == 30.0

_TO_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
_TO_FLU = np.diag([1.0, -1.0, -1.0])
_START_NS = 1_700_000_000_000_000_000


TOPICS = {
    "imu/data_raw": "sensor_msgs/msg/Imu",
    "imu/data": "sensor_msgs/msg/Imu",
    "imu/static_pressure": "sensor_msgs/msg/FluidPressure",
    "vfr_hud": "mavros_msgs/msg/VfrHud",
    "rc/out": "mavros_msgs/msg/RCOut",
}


@cache
def _store(release: Stores | None = None) -> Typestore:
    types = deepcopy(type_store()) if release is None else get_typestore(release)
    for kind, text in DEFINITIONS.items():
        types.register(get_types_from_msg("\n".join(line.strip() for line in text.splitlines()), kind))
    return types


def mavros_bag(
    path: Path,
    rate: float = 100.0,
    seconds: float = 20.0,
    *,
    namespaces: Sequence[str] = ("/mavros",),
    drop: Collection[str] = (),
    storage: StoragePlugin = StoragePlugin.SQLITE3,
) -> None:
    """The first ``seconds`` of the flight with every topic, but those that are dropped, at ``rate`` Hz.

    The vehicles of all ``namespaces`` fly alike; "/uav/imu/data" is dropped as "imu/data" or, of one, whole.
    """
    with Writer(path, version=9, storage_plugin=storage) as writer:
        connections = {
            (namespace, topic): writer.add_connection(f"{namespace}/{topic}", kind, typestore=_store())
            for namespace in namespaces
            for topic, kind in TOPICS.items()
            if topic not in drop and f"{namespace}/{topic}" not in drop
        }
        for stamp, messages in _messages(rate, seconds):
            for (_, topic), connection in connections.items():
                message = _built(TOPICS[topic], messages[topic], stamp, _store())
                writer.write(connection, stamp, _store().serialize_cdr(message, TOPICS[topic]))


def mavros1_bag(path: Path, seconds: float = 20.0, restart: float = 1e9) -> None:
    """The same as a bag of ROS 1, whose MAVROS was started again after ``restart`` s: two connections a topic."""
    types = _store(Stores.ROS1_NOETIC)
    with Writer1(path) as writer:
        connections = {
            (again, topic): writer.add_connection(f"/mavros/{topic}", kind, typestore=types, callerid=f"/mavros{again}")
            for again in (False, True)
            for topic, kind in TOPICS.items()
        }
        for stamp, messages in _messages(100.0, seconds):
            again = stamp - _START_NS - round(flight().between(2.0, 2.1).time[0] * 1e9) > restart * 1e9
            for topic, kind in TOPICS.items():
                data = types.serialize_ros1(_built(kind, messages[topic], stamp, types), kind)
                writer.write(connections[again, topic], stamp, data)


def without_definitions(bag: Path) -> None:
    """Drop the definitions of messages from a sqlite3 bag: ROS 2 before Iron writes none."""
    for file in bag.glob("*.db3"):
        with closing(sqlite3.connect(file)) as database:
            database.execute("DELETE FROM message_definitions")
            database.commit()


def _messages(rate: float, seconds: float) -> Iterator[tuple[int, dict[str, dict[str, Any]]]]:
    """The stamps, and the fields of the messages of all topics."""
    record = flight().between(2.0, 2.0 + seconds)
    pulses = pulses_of(fractions(record))
    euler = np.column_stack([record[name] for name in ("psi", "theta", "phi")])
    turned = Rotation.from_matrix(_TO_ENU @ Rotation.from_euler("ZYX", euler).as_matrix() @ _TO_FLU).as_quat()
    force, rates = (
        np.column_stack([record[name] for name in names]) for names in (("ax", "ay", "az"), ("p", "q", "r"))
    )
    equivalent = record["V"] * np.sqrt(record["rho"] / 1.225)
    pressure = record["rho"] * 287.05287 * 288.15
    for i in picked(record, rate).tolist():
        motion = {
            "linear_acceleration": dict(zip("xyz", _TO_FLU @ force[i], strict=True)),
            "angular_velocity": dict(zip("xyz", _TO_FLU @ rates[i], strict=True)),
        }
        messages = {
            "imu/static_pressure": {"fluid_pressure": pressure[i]},
            "imu/data": {"orientation": dict(zip("xyzw", turned[i], strict=True)), **motion},
            "imu/data_raw": motion,
            "vfr_hud": {"airspeed": equivalent[i]},
            "rc/out": {"channels": np.array([*pulses[i], 0, 0], np.uint16)},
        }
        yield _START_NS + round(record.time[i] * 1e9), messages


def _built(kind: str, fields: dict[str, Any], stamp: int, types: Typestore) -> Any:
    """A message; fields that are not given are zero."""
    if kind == "builtin_interfaces/msg/Time":
        fields = {"sec": stamp // 10**9, "nanosec": stamp % 10**9}
    values = {name: _value(node, fields.get(name), stamp, types) for name, node in types.fielddefs[kind][1]}
    return types.types[kind](**values)


def _value(node: Any, given: Any, stamp: int, types: Typestore) -> Any:
    kind, detail = node
    if kind == Nodetype.NAME:
        return _built(detail, given or {}, stamp, types)
    if kind == Nodetype.BASE:
        return given if given is not None else "" if detail[0] == "string" else 0
    return given if given is not None else np.zeros(detail[1] or 0)
