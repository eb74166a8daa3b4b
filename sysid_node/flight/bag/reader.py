"""Reads rosbag2 recordings, sqlite3 or mcap, as streams, through rosbags and without ROS."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.bag.raw_messages import RawMessages, read_messages
from sysid_node.flight.bag.storage_files import checked_files
from sysid_node.flight.cdr.decoding import DecodedMessages, decode
from sysid_node.flight.frames import BodyFrame, euler_from_quaternion, turn_vectors
from sysid_node.flight.record import Array
from sysid_node.flight.streams import (
    COMMAND_FRACTIONS,
    COMMANDS,
    AirDataStream,
    Arrival,
    ImuStream,
    JointStream,
    Stamps,
    Streams,
)
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS, topic_names

RECORDER_JUMP = 300.0  # s; a larger step of the recorder's clock means that it was set or that it paused
JOINT_LIMIT = 1000  # different joints of a vehicle
#: A heading with a larger variance (rad^2) counts as not measured.
HEADING_UNKNOWN = 1.0e3


def read_streams(path: str | Path, topics: Mapping[str, str] | None = None, frame: BodyFrame = "flu") -> Streams:
    """The three input topics of a bag: a folder with metadata.yaml, or an .mcap or .db3 file alone.

    ``topics`` as of ``topic_names``; ``frame`` is that of the bag's IMU messages. Raises InputError (one line: what
    is wrong with which file or topic, and what to do) where the bag is missing, empty, cut short or damaged, or lacks
    a topic.
    """
    path, topics = Path(path), topics or topic_names()
    name = f"bag {path.name}"
    with open_bag(path) as reader, reading(path):
        chosen = input_connections(reader, topics, name)
        watch = RecordingWatch(name, topics, chosen)
        raw = read_messages(reader, chosen)
        watch.take(raw)
        watch.close()
        return decoded(raw, frame, name)


def decoded(
    raw: Mapping[str, RawMessages], frame: BodyFrame, name: str, joints: Sequence[str] | None = None
) -> Streams:
    """The messages of the input topics as arrays. With ``joints``, those known so far, they are a piece of a flight.

    Raises DamageError where a message is damaged, InputError where there are too many joints.
    """
    actuators = _joint_stream(raw[ACTUATORS], joints or ())
    imu, air_data = _imu_stream(raw[IMU], frame), _air_data_stream(raw[AIR_DATA])
    return Streams(imu, air_data, actuators, name, piece=joints is not None)


@contextmanager
def open_bag(path: Path) -> Iterator[Reader]:
    """A bag that is open for reading. Raises InputError where it is missing, empty or damaged; see ``reading``."""
    with ExitStack() as stack:
        with reading(path):
            reader = stack.enter_context(Reader(stack.enter_context(checked_files(path))))
            if not reader.message_count:
                raise InputError(f"bag {path.name}: holds no messages; record imu/data, air_data and actuators")
        yield reader


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """A context in which every error in reading a bag becomes an InputError: one line, with a remedy."""
    try:
        yield
    except InputError:
        raise
    except FileNotFoundError as error:
        raise InputError(f"bag {path.name}: {_not_found(path)}") from error
    except Exception as error:  # parsers of a damaged file raise all kinds of exceptions
        raise InputError(
            f"bag {path.name}: cannot be read: {_one_line(error)}; {_remedy(path, _one_line(error))}"
        ) from error


def _not_found(path: Path) -> str:
    if not path.exists():
        return f"does not exist in {path.resolve().parent}; give a rosbag2 folder, .mcap or .db3 file"
    files = sorted(file.name for file in path.iterdir() if file.suffix in {".mcap", ".db3"})
    if files:
        return f"no metadata.yaml (a recording that was cut short?); run: ros2 bag reindex {path}, or give {files[0]}"
    return f"no bag: neither metadata.yaml nor an .mcap or .db3 file in {path}"


def _remedy(path: Path, reason: str) -> str:
    if path.is_file() and path.suffix not in (".mcap", ".db3"):
        return "give a rosbag2 folder, .mcap or .db3 file; sysid convert makes a bag of a log"
    if path.is_dir() and ("metadata" in reason or "Rosbag2 version" in reason):
        return f"its metadata.yaml is damaged; run: ros2 bag reindex {path}"
    mcap = path.suffix == ".mcap" or (path.is_dir() and any(path.glob("*.mcap")))
    repair = "mcap recover FILE.mcap -o NEW.mcap" if mcap else "sqlite3 FILE.db3 .recover | sqlite3 NEW.db3"
    return f"give a rosbag2 folder, .mcap or .db3 file; if this one was cut short, try: {repair}"


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


class RecordingWatch:
    """What is wrong with a recording as a whole: topics without messages, messages that lack, a clock that was set."""

    def __init__(self, bag: str, topics: Mapping[str, str], chosen: Mapping[str, Sequence[Connection]]) -> None:
        self._bag, self._topics = bag, topics
        self._promised = {topic: sum(connection.msgcount for connection in chosen[topic]) for topic in topics}
        self._found = dict.fromkeys(topics, 0)
        self._log_ns: int | None = None  # of the last message
        self._since = 0.0  # s of the recording so far, without a jump
        self._jumped = False

    def take(self, raw: Mapping[str, RawMessages]) -> None:
        """Look at the next messages; warns of the first jump of the recorder's clock."""
        messages = [raw[topic] for topic in self._topics]
        for topic, one in zip(self._topics, messages, strict=True):
            self._found[topic] += len(one.data)
        order = np.argsort(np.concatenate([one.order for one in messages]))
        log_ns = np.concatenate([one.log_ns for one in messages])[order]
        if self._log_ns is not None:
            log_ns = np.concatenate([[self._log_ns], log_ns])
        if log_ns.size:
            self._log_ns = int(log_ns[-1])
        if not self._jumped:
            self._look_for_jump(np.diff(log_ns) / 1e9)

    def _look_for_jump(self, step: Array) -> None:
        jumps = np.flatnonzero((step > RECORDER_JUMP) | (step < -1.0))
        self._jumped = bool(jumps.size)
        before = step[: jumps[0]] if jumps.size else step
        self._since += float(np.clip(before, 0.0, RECORDER_JUMP).sum())
        if jumps.size:
            warnings.warn(
                f"{self._bag}: the recorder's clock jumps by {step[jumps[0]]:.0f} s, {self._since:.1f} s into the "
                "recording (it was set or the recording was paused); the headers' stamps are used, the jump is left "
                "out",
                InputWarning,
                stacklevel=3,
            )

    def close(self) -> None:
        """After the last message: raises InputError where a topic had none, warns where some lack."""
        for topic, found in self._found.items():
            if not found:
                raise InputError(f"{self._bag}: no messages on {self._topics[topic]}; record that topic too")
            if self._promised[topic] > found:
                warnings.warn(
                    f"{self._bag}: {self._promised[topic] - found} of {self._promised[topic]} messages on "
                    f"{self._topics[topic]} that the bag's index promises are not in it; it is damaged or was cut "
                    "short",
                    InputWarning,
                    stacklevel=3,
                )


def input_connections(reader: Reader, topics: Mapping[str, str], bag: str) -> dict[str, list[Connection]]:
    """The connections of each input topic. Raises InputError where one is missing or of another type."""
    recorded = {name: {c.msgtype for c in info.connections} for name, info in reader.topics.items()}
    for topic, name in topics.items():
        wanted = INPUT_TOPICS[topic]
        if name not in recorded:
            present = ", ".join(f"{other} ({'/'.join(sorted(types))})" for other, types in recorded.items())
            alike = [other for other, types in recorded.items() if wanted in types and other not in topics.values()]
            example = f"--topic {topic}:={alike[0] if alike else '/its/name'}"
            raise InputError(f"{bag}: no topic {name} ({wanted}); it has {present}; if it is one of these: {example}")
        if recorded[name] != {wanted}:
            raise InputError(f"{bag}: topic {name} is {'/'.join(sorted(recorded[name]))}, expected {wanted}")
        known = type_store().hash_rihs01(wanted)
        if any(c.topic == name and c.digest not in {"", known} for c in reader.connections):
            raise InputError(f"{bag}: topic {name} was recorded with another definition of {wanted}; use that version")
    return {topic: [c for c in reader.connections if c.topic == name] for topic, name in topics.items()}


def _arrival(raw: RawMessages, stamp_ns: Stamps) -> Arrival:
    return Arrival(stamp_ns, raw.log_ns, raw.order)


def _stamps(fields: DecodedMessages) -> Stamps:
    """Header stamps, ns."""
    seconds = fields.numbers("header.stamp.sec").astype(np.int64)
    nanoseconds: Stamps = seconds * 1_000_000_000 + fields.numbers("header.stamp.nanosec")
    return nanoseconds


def _columns(fields: DecodedMessages, *paths: str) -> Array:
    """Numbers at several paths, side by side (n, len(paths))."""
    return np.column_stack([fields.numbers(path) for path in paths]).astype(np.float64, copy=False)


def _imu_stream(raw: RawMessages, frame: BodyFrame) -> ImuStream:
    count = len(raw.data)
    stamps, values, attitude = np.empty(count, np.int64), np.empty((count, 6)), np.empty((count, 3))
    frame_id = ""
    for at, fields in decode(definitions_of(type_store()), INPUT_TOPICS[IMU], raw.data):
        stamps[at] = _stamps(fields)
        force = _columns(fields, *(f"linear_acceleration.{axis}" for axis in "xyz"))
        rates = _columns(fields, *(f"angular_velocity.{axis}" for axis in "xyz"))
        values[at] = np.column_stack([turn_vectors(force, frame), turn_vectors(rates, frame)])
        attitude[at] = _attitude(fields, frame)
        frame_id = fields.strings("header.frame_id")[0]
    return ImuStream(_arrival(raw, stamps), values, attitude, frame_id)


def _attitude(fields: DecodedMessages, frame: BodyFrame) -> Array:
    """Euler angles (n, 3) rad; NaN where the covariance (sensor_msgs/Imu) or the quaternion marks them unknown."""
    euler = euler_from_quaternion(_columns(fields, *(f"orientation.{axis}" for axis in "xyzw")), frame)
    covariance = fields.numbers("orientation_covariance")
    euler[covariance[:, 0] == -1.0] = np.nan
    euler[covariance[:, 8] > HEADING_UNKNOWN, 2] = np.nan
    return euler


def _air_data_stream(raw: RawMessages) -> AirDataStream:
    stamps, values = np.empty(len(raw.data), np.int64), np.empty((len(raw.data), 4))
    for at, fields in decode(definitions_of(type_store()), INPUT_TOPICS[AIR_DATA], raw.data):
        stamps[at] = _stamps(fields)
        values[at] = _columns(fields, "true_airspeed", "angle_of_attack", "sideslip", "air_density")
    return AirDataStream(_arrival(raw, stamps), values)


def _joint_stream(raw: RawMessages, known: Sequence[str]) -> JointStream:
    stamps = np.empty(len(raw.data), np.int64)
    parts: list[tuple[NDArray[np.intp], Sequence[str], NDArray[Any]]] = []
    content = ""
    for at, fields in decode(definitions_of(type_store()), INPUT_TOPICS[ACTUATORS], raw.data):
        stamps[at] = _stamps(fields)
        parts.append((at, fields.strings("name"), fields.numbers("position")))
        frame_id = fields.strings("header.frame_id")[0]
        content = frame_id if frame_id in (COMMANDS, COMMAND_FRACTIONS) else content
    names = tuple(dict.fromkeys([*known, *(name for _, part_names, _ in parts for name in part_names)]))
    if len(names) > JOINT_LIMIT:
        raise InputError(f"{len(names)} different joints in the messages, over {JOINT_LIMIT}; names must not change")
    place = {name: i for i, name in enumerate(names)}
    positions = np.full((len(raw.data), len(names)), np.nan)
    for at, part_names, values in parts:
        # The first position of a name that is given twice counts; a name without a position stays NaN.
        for i in reversed(range(min(len(part_names), values.shape[1]))):
            positions[at, place[part_names[i]]] = values[:, i]
    return JointStream(_arrival(raw, stamps), names, positions, content)
