"""Writes streams as rosbag2 recordings, sqlite3 or mcap, through rosbags and without ROS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from heapq import merge
from itertools import repeat
from pathlib import Path

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError

from sysid_node.errors import InputError
from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.bag.reader import HEADING_UNKNOWN
from sysid_node.flight.bag.storage_files import add_checksums, writable_path
from sysid_node.flight.cdr.template import Templates, Values
from sysid_node.flight.frames import BodyFrame, quaternion_from_euler, turn_vectors
from sysid_node.flight.record import Array
from sysid_node.flight.streams import AirDataStream, ImuStream, JointStream, Stream, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS, topic_names

STORAGES: Mapping[str, StoragePlugin] = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}


@contextmanager
def new_bag(path: str | Path, storage: str = "mcap") -> Iterator[Writer]:
    """A bag to write: a folder that does not exist yet. Raises InputError where it exists or cannot be made."""
    path = Path(path)
    if storage not in STORAGES:
        raise InputError(f"storage {storage!r}: expected {' or '.join(STORAGES)}")
    try:
        with (
            writable_path(path, storage) as place,
            Writer(place, version=9, storage_plugin=STORAGES[storage]) as writer,
        ):
            yield writer
        for file in path.glob("*.mcap"):
            add_checksums(file)
    except (WriterError, OSError) as error:
        if path.exists() and isinstance(error, WriterError):
            raise InputError(f"bag {path}: exists already; remove it or choose another name") from error
        raise InputError(f"bag {path}: cannot be written: {error}") from error


def write_streams(
    path: str | Path,
    streams: Streams,
    storage: str = "mcap",
    frame: BodyFrame = "flu",
    joints: Mapping[str, JointStream] | None = None,
) -> None:
    """Write a bag of the three input topics, in log order; ``frame`` is that of its IMU messages.

    ``joints`` are further joint states by topic, such as commands beside positions. Raises InputError where the bag
    exists or cannot be written.
    """
    topics = topic_names()
    messages = {
        IMU: imu_messages(streams.imu, frame),
        AIR_DATA: air_data_messages(streams.air_data),
        ACTUATORS: joint_messages(streams.actuators),
    }
    with new_bag(path, storage) as writer:
        connections = {topic: add_topic(writer, topics[topic], INPUT_TOPICS[topic]) for topic in messages}
        recorded = [
            (int(order), int(log_ns), topic, data)
            for topic, stream in streams.by_topic.items()
            for order, log_ns, data in zip(stream.arrival.order, stream.arrival.log_ns, messages[topic], strict=True)
        ]
        recorded.sort(key=lambda message: message[0])
        for topic, stream in (joints or {}).items():
            connections[topic] = add_topic(writer, topic, INPUT_TOPICS[ACTUATORS])
            log_ns = stream.arrival.log_ns.tolist()
            further = zip(repeat(-1), log_ns, repeat(topic), joint_messages(stream), strict=False)
            recorded = list(merge(recorded, further, key=lambda message: message[1]))
        for _, at, topic, data in recorded:
            writer.write(connections[topic], at, data)


def add_topic(writer: Writer, topic: str, msgtype: str) -> Connection:
    """A topic of a bag that is being written."""
    return writer.add_connection(topic, msgtype, typestore=type_store())


def imu_messages(stream: ImuStream, frame: BodyFrame) -> list[bytes]:
    """sensor_msgs/Imu: no orientation where roll or pitch is unknown, a large variance where the heading is unknown."""
    known = np.isfinite(stream.attitude)
    rotation = quaternion_from_euler(np.where(known, stream.attitude, 0.0), frame)
    no_covariance = np.zeros((len(stream.arrival), 9))
    covariance = no_covariance.copy()
    covariance[~known[:, 2], 8] = 10.0 * HEADING_UNKNOWN
    absent = ~known[:, :2].all(axis=1)
    rotation[absent] = 0.0
    covariance[absent, 0] = -1.0
    force, rates = (turn_vectors(vectors, frame) for vectors in (stream.values[:, :3], stream.values[:, 3:]))
    columns = np.hstack([rotation, covariance, rates, no_covariance, force, no_covariance])
    vector, matrix = (0.0,) * 3, (0.0,) * 9
    body = ((0.0,) * 4, matrix, vector, matrix, vector, matrix)
    return _stamped(IMU, stream, stream.frame_id, body, columns)


def air_data_messages(stream: AirDataStream) -> list[bytes]:
    """sysid_msgs/AirData."""
    return _stamped(AIR_DATA, stream, "air_data", (0.0,) * 4, stream.values)


def joint_messages(stream: JointStream) -> list[bytes]:
    """sensor_msgs/JointState with positions alone."""
    return _stamped(
        ACTUATORS, stream, stream.content, (stream.names, (0.0,) * len(stream.names), (), ()), stream.positions
    )


def _stamped(topic: str, stream: Stream, frame_id: str, body: Values, columns: Array) -> list[bytes]:
    """N messages of an input topic: a header, then ``body``, whose float64 numbers are the rows of ``columns``."""
    templates = Templates(definitions_of(type_store()))
    template = templates.template(INPUT_TOPICS[topic], (((0, 0), frame_id), *body))
    seconds, nanoseconds = np.divmod(stream.arrival.stamp_ns[:, np.newaxis], 1_000_000_000)
    if not columns.shape[1]:
        return template.write(i4=seconds, u4=nanoseconds)
    return template.write(i4=seconds, u4=nanoseconds, f8=columns)
