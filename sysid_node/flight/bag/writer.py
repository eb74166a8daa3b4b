"""Streams and estimates to bags: rosbag2, sqlite3 or mcap, written through rosbags without ROS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.typesys.store import Typestore

from sysid_node.errors import InputError
from sysid_node.flight.bag.message_types import message_layout, type_store
from sysid_node.flight.bag.reader import HEADING_UNKNOWN
from sysid_node.flight.cdr.decode import encode
from sysid_node.flight.frames import BodyFrame, quaternion_from_euler, turn_vectors
from sysid_node.flight.streams import AirDataStream, ImuStream, JointStream, Stamps, Stream, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS, topic_names

STORAGES: Mapping[str, StoragePlugin] = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}


@contextmanager
def new_bag(path: str | Path, storage: str = "mcap") -> Iterator[Writer]:
    """A bag to write: a folder that does not exist yet. Raises InputError where it does or cannot be made."""
    if storage not in STORAGES:
        raise InputError(f"storage {storage!r}: expected {' or '.join(STORAGES)}")
    try:
        with Writer(path, version=9, storage_plugin=STORAGES[storage]) as writer:
            yield writer
    except (WriterError, OSError) as error:
        if Path(path).exists() and isinstance(error, WriterError):
            raise InputError(f"bag {path}: exists already; remove it or choose another name") from error
        raise InputError(f"bag {path}: cannot be written: {error}") from error


def write_streams(path: str | Path, streams: Streams, storage: str = "mcap", frame: BodyFrame = "flu") -> None:
    """A bag of the three input topics, in log order; ``frame`` is that of its IMU messages.

    Raises InputError where the bag exists or cannot be written.
    """
    store, topics = type_store(), topic_names()
    messages = {
        IMU: _imu_messages(store, streams.imu, frame),
        AIR_DATA: _air_data_messages(store, streams.air_data),
        ACTUATORS: _joint_messages(store, streams.actuators),
    }
    with new_bag(path, storage) as writer:
        into = {topic: add_topic(writer, topics[topic], INPUT_TOPICS[topic]) for topic in messages}
        every = (
            (int(order), int(log_ns), topic, data)
            for topic, stream in streams.by_topic.items()
            for order, log_ns, data in zip(stream.arrival.order, stream.arrival.log_ns, messages[topic], strict=True)
        )
        for _, log_ns, topic, data in sorted(every, key=lambda message: message[0]):
            writer.write(into[topic], log_ns, data)


def add_topic(writer: Writer, topic: str, msgtype: str) -> Connection:
    """A topic of a bag that is being written."""
    return writer.add_connection(topic, msgtype, typestore=type_store())


def header(store: Typestore, frame_id: str) -> Any:
    """A std_msgs/Header without a stamp."""
    time = store.types["builtin_interfaces/msg/Time"](0, 0)
    return store.types["std_msgs/msg/Header"](time, frame_id)


def stamp_columns(stamps: Stamps) -> dict[str, NDArray[Any]]:
    """The header's columns."""
    return {"header.stamp.sec": stamps // 1_000_000_000, "header.stamp.nanosec": stamps % 1_000_000_000}


def _encode(store: Typestore, msgtype: str, template: Any, stream: Stream, columns: Mapping[str, Any]) -> list[bytes]:
    layout = message_layout(store, msgtype, template)
    return encode(layout, {**stamp_columns(stream.arrival.stamp_ns), **columns}, len(stream.arrival))


def _imu_messages(store: Typestore, stream: ImuStream, frame: BodyFrame) -> list[bytes]:
    """sensor_msgs/Imu: no orientation where roll or pitch are not known; a great variance where the heading is not."""
    msgtype, types = INPUT_TOPICS[IMU], store.types
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    none = np.zeros(9)
    template = types[msgtype](
        header(store, stream.frame_id), quaternion(0, 0, 0, 1), none, vector(0, 0, 0), none, vector(0, 0, 0), none
    )
    known = np.isfinite(stream.attitude)
    rotation = quaternion_from_euler(np.where(known, stream.attitude, 0.0), frame)
    covariance = np.zeros((len(stream.arrival), 9))
    covariance[~known[:, 2], 8] = 10.0 * HEADING_UNKNOWN
    absent = ~known[:, :2].all(axis=1)
    rotation[absent] = 0.0
    covariance[absent, 0] = -1.0
    columns = {"orientation_covariance": covariance}
    columns |= {f"orientation.{axis}": rotation[:, i] for i, axis in enumerate("xyzw")}
    for name, vectors in (("linear_acceleration", stream.values[:, :3]), ("angular_velocity", stream.values[:, 3:])):
        columns |= {f"{name}.{axis}": turn_vectors(vectors, frame)[:, i] for i, axis in enumerate("xyz")}
    return _encode(store, msgtype, template, stream, columns)


def _air_data_messages(store: Typestore, stream: AirDataStream) -> list[bytes]:
    msgtype = INPUT_TOPICS[AIR_DATA]
    names = ("true_airspeed", "angle_of_attack", "sideslip", "air_density")
    template = store.types[msgtype](header(store, "air_data"), 0.0, 0.0, 0.0, 0.0)
    return _encode(store, msgtype, template, stream, dict(zip(names, stream.values.T, strict=True)))


def _joint_messages(store: Typestore, stream: JointStream) -> list[bytes]:
    msgtype, none = INPUT_TOPICS[ACTUATORS], np.zeros(0)
    template = store.types[msgtype](header(store, ""), list(stream.names), np.zeros(len(stream.names)), none, none)
    return _encode(store, msgtype, template, stream, {"position": stream.positions})
