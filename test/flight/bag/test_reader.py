"""Bags: what is written is read back to the last bit; what is wrong with a bag is one line that says what to do."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from made_flights import JOINTS, header, made_streams
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sysid_node.errors import InputError
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import add_topic, air_data_messages, imu_messages, new_bag, write_streams
from sysid_node.flight.streams import Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS, topic_names

STORE = type_store()


@pytest.fixture
def streams() -> Streams:
    return made_streams(2.0)


@pytest.fixture
def bag(tmp_path, streams) -> Path:
    write_streams(tmp_path / "flight", streams)
    return tmp_path / "flight"


def error_of(path, *args, **kwargs) -> str:
    with pytest.raises(InputError) as caught:
        read_streams(path, *args, **kwargs)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def put(writer, topic, messages):
    """Messages on an input topic, all logged at once."""
    connection = add_topic(writer, f"/{topic}", INPUT_TOPICS[topic])
    for message in messages:
        writer.write(connection, 1, message)


def same(ours: Streams, theirs: Streams) -> None:
    for topic, stream in ours.by_topic.items():
        other = theirs.by_topic[topic]
        for column in ("stamp_ns", "log_ns", "order"):
            np.testing.assert_array_equal(getattr(stream.arrival, column), getattr(other.arrival, column))
    np.testing.assert_array_equal(ours.imu.values, theirs.imu.values)
    np.testing.assert_array_equal(ours.air_data.values, theirs.air_data.values)
    np.testing.assert_array_equal(ours.actuators.positions, theirs.actuators.positions)
    np.testing.assert_allclose(ours.imu.attitude, theirs.imu.attitude, atol=1e-9)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("frame", ["flu", "frd"])
def test_round_trip_to_the_last_bit(tmp_path, streams, storage, frame):
    write_streams(tmp_path / "flight", streams, storage, frame)
    back = read_streams(tmp_path / "flight", frame=frame)
    same(back, streams)
    assert back.actuators.names == JOINTS
    assert back.imu.frame_id == "imu"
    (file,) = (tmp_path / "flight").glob("*.mcap" if storage == "mcap" else "*.db3")
    same(read_streams(file, frame=frame), streams)


def test_messages_are_in_the_frame_that_was_asked_for(bag, streams):
    with Reader(bag) as reader:
        connection = next(c for c in reader.connections if c.topic == "/imu/data")
        _, _, raw = next(reader.messages([connection]))
    force = STORE.deserialize_cdr(raw, connection.msgtype).linear_acceleration
    assert (force.x, force.y, force.z) == tuple(streams.imu.values[0, :3] * [1, -1, -1])


def test_bulk_reading_equals_rosbags_message_by_message(bag, streams):
    rows: dict[str, list[tuple[float, ...]]] = {"/imu/data": [], "/air_data": [], "/actuators": []}
    with Reader(bag) as reader:
        for connection, _, raw in reader.messages():
            m = STORE.deserialize_cdr(raw, connection.msgtype)
            if connection.topic == "/imu/data":
                f, w = m.linear_acceleration, m.angular_velocity
                row = (f.x, -f.y, -f.z, w.x, -w.y, -w.z)
            elif connection.topic == "/air_data":
                row = (m.true_airspeed, m.angle_of_attack, m.sideslip, m.air_density)
            else:
                row = tuple(m.position)
            rows[connection.topic].append(row)
    back = read_streams(bag)
    np.testing.assert_array_equal(back.imu.values, rows["/imu/data"])
    np.testing.assert_array_equal(back.air_data.values, rows["/air_data"])
    np.testing.assert_array_equal(back.actuators.positions, rows["/actuators"])


def test_attitude_that_is_not_given_stays_unknown(tmp_path, streams):
    attitude = streams.imu.attitude.copy()
    attitude[3, 0], attitude[5, 2] = np.nan, np.nan
    write_streams(
        tmp_path / "flight", dataclasses.replace(streams, imu=dataclasses.replace(streams.imu, attitude=attitude))
    )
    back = read_streams(tmp_path / "flight").imu.attitude
    assert np.isnan(back[3]).all()  # without roll there is no orientation
    assert np.isnan(back[5]).tolist() == [False, False, True]
    assert np.isfinite(back[[0, 1, 2, 4]]).all()


def test_joints_that_come_and_go(tmp_path, streams):
    """Two nodes with different joints on one topic: each message's own names count, in whatever order."""
    vector = np.array([0.1, 0.2])
    with new_bag(tmp_path / "flight") as writer:
        for topic, messages in (
            (IMU, imu_messages(streams.imu, "flu")),
            (AIR_DATA, air_data_messages(streams.air_data)),
        ):
            put(writer, topic, messages)
        connection = add_topic(writer, "/actuators", INPUT_TOPICS[ACTUATORS])
        for names, positions in ((["a", "b"], vector), (["b", "c"], vector), (["b", "a", "a"], vector)):
            none = np.zeros(0)
            message = STORE.types[INPUT_TOPICS[ACTUATORS]](header(STORE, ""), names, positions, none, none)
            writer.write(connection, 1, STORE.serialize_cdr(message, INPUT_TOPICS[ACTUATORS]))
    joints = read_streams(tmp_path / "flight").actuators
    assert joints.names == ("a", "b", "c")
    nan = np.nan
    np.testing.assert_array_equal(joints.positions, [[0.1, 0.2, nan], [nan, 0.1, 0.2], [0.2, 0.1, nan]])


def test_missing_bag(tmp_path):
    for name in ("none", "none.mcap"):
        expected = f"bag {name}: does not exist in {tmp_path}; give a rosbag2 folder, .mcap or .db3 file"
        assert error_of(tmp_path / name) == expected


def test_folder_without_a_bag(tmp_path):
    assert "no bag" in error_of(tmp_path)


def test_folder_without_metadata_tells_how_to_make_it(bag):
    (bag / "metadata.yaml").unlink()
    assert "ros2 bag reindex" in error_of(bag)


@pytest.mark.parametrize("name", ["notes.txt", "x.mcap", "x.db3"])
@pytest.mark.parametrize("content", [b"", b"no bag at all, but long enough to look into for a magic number or a page"])
def test_a_file_that_is_no_bag(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    text = error_of(tmp_path / name)
    assert name in text
    assert "cannot be read" in text


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_bag_cut_short(tmp_path, storage, share):
    write_streams(tmp_path / "flight", made_streams(6.0), storage)
    (file,) = (file for file in (tmp_path / "flight").iterdir() if file.suffix in {".mcap", ".db3"})
    file.write_bytes(file.read_bytes()[: int(file.stat().st_size * share)])
    assert "cut short, try: " in error_of(tmp_path / "flight")


def test_damaged_bytes_within(tmp_path):
    write_streams(tmp_path / "flight", made_streams(6.0))
    (file,) = (tmp_path / "flight").glob("*.mcap")
    content = bytearray(file.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 4000] = b"\xff" * 4000
    file.write_bytes(content)
    assert "cannot be read" in error_of(tmp_path / "flight")


def test_bag_without_messages(tmp_path):
    with new_bag(tmp_path / "flight") as writer:
        add_topic(writer, "/imu/data", INPUT_TOPICS[IMU])
    assert "holds no messages" in error_of(tmp_path / "flight")


def test_missing_topic_lists_what_is_there_and_the_option(bag):
    text = error_of(bag, topic_names(["imu/data:=/mavros/imu"]))
    assert "no topic /mavros/imu (sensor_msgs/msg/Imu)" in text
    assert "/air_data (sysid_msgs/msg/AirData)" in text
    assert "--topic imu/data:=/imu/data" in text


def test_remapped_topic_is_read(bag, tmp_path, streams):
    with Reader(bag) as reader, new_bag(tmp_path / "other") as writer:
        theirs = {"/imu/data": "/vehicle/imu"}
        topics = {c.id: add_topic(writer, theirs.get(c.topic, c.topic), c.msgtype) for c in reader.connections}
        for connection, stamp, data in reader.messages():
            writer.write(topics[connection.id], stamp, data)
    assert "no topic" in error_of(tmp_path / "other")
    same(read_streams(tmp_path / "other", topic_names(["imu/data:=/vehicle/imu"])), streams)


def test_topic_of_another_type(bag):
    text = error_of(bag, topic_names(["imu/data:=/air_data"]))
    assert "topic /air_data is sysid_msgs/msg/AirData, expected sensor_msgs/msg/Imu" in text


def test_another_version_of_our_message(tmp_path, streams):
    other = get_typestore(Stores.ROS2_JAZZY)
    other.register(get_types_from_msg("std_msgs/Header header\nfloat64 airspeed", INPUT_TOPICS[AIR_DATA]))
    with new_bag(tmp_path / "flight") as writer:
        for topic in (IMU, ACTUATORS):
            add_topic(writer, f"/{topic}", INPUT_TOPICS[topic])
        connection = writer.add_connection("/air_data", INPUT_TOPICS[AIR_DATA], typestore=other)
        message = other.types[INPUT_TOPICS[AIR_DATA]](header(other, ""), 18.0)
        writer.write(connection, 1, other.serialize_cdr(message, INPUT_TOPICS[AIR_DATA]))
    assert "another definition of sysid_msgs/msg/AirData" in error_of(tmp_path / "flight")


def test_topic_without_messages(tmp_path, streams):
    with new_bag(tmp_path / "flight") as writer:
        for topic in (IMU, ACTUATORS):
            add_topic(writer, f"/{topic}", INPUT_TOPICS[topic])
        messages = air_data_messages(streams.air_data)
        put(writer, AIR_DATA, messages)
    assert "no messages on /imu/data" in error_of(tmp_path / "flight")


def test_existing_bag_is_not_overwritten(bag, streams):
    before = sorted((file.name, file.stat().st_size) for file in bag.iterdir())
    with pytest.raises(InputError, match="exists already"):
        write_streams(bag, streams)
    assert sorted((file.name, file.stat().st_size) for file in bag.iterdir()) == before


def test_unknown_storage(tmp_path, streams):
    with pytest.raises(InputError, match=r"'rosbag1': expected mcap or sqlite3"):
        write_streams(tmp_path / "flight", streams, "rosbag1")


def test_place_that_cannot_be_written(tmp_path, streams):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_streams(tmp_path / "file" / "flight", streams)
