"""A flight in pieces is the flight: every message once, in order, whatever the size of the pieces."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from made_flights import header, made_aircraft, made_streams

from sysid_node.errors import InputError
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import add_topic, new_bag, write_streams
from sysid_node.flight.commands import COMMANDS, read_commands
from sysid_node.flight.pieces import flight_pieces
from sysid_node.flight.streams import JointStream
from sysid_node.flight.topics import INPUT_TOPICS, topic_names

AIRCRAFT = made_aircraft()


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds, with commands beside the positions, in both storages."""
    folder, streams = tmp_path_factory.mktemp("pieces"), made_streams(2.0)
    for storage in ("mcap", "sqlite3"):
        write_streams(folder / storage, streams, storage, joints={COMMANDS: streams.actuators})
    return folder


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("size", [1, 7, 250, 10**6])
def test_the_pieces_are_the_flight(bags: Path, storage: str, size: int) -> None:
    whole = read_streams(bags / storage)
    with flight_pieces(bags / storage, AIRCRAFT, size=size) as flight:
        pieces = list(flight.pieces)
    assert flight.messages == sum(len(stream.arrival) for stream in whole.by_topic.values())
    assert [piece.last for piece in pieces] == [False] * (len(pieces) - 1) + [True]
    assert max(sum(len(s.arrival) for s in p.streams.by_topic.values()) for p in pieces) <= size + 8
    for name in ("imu", "air_data", "actuators"):
        parts, stream = [getattr(piece.streams, name) for piece in pieces], getattr(whole, name)
        for field in ("stamp_ns", "log_ns"):
            joined = np.concatenate([getattr(part.arrival, field) for part in parts])
            np.testing.assert_array_equal(joined, getattr(stream.arrival, field))
        values = [part.positions if isinstance(part, JointStream) else part.values for part in parts]
        values = [part for part in values if len(part)]
        np.testing.assert_array_equal(
            np.concatenate(values), stream.positions if isinstance(stream, JointStream) else stream.values
        )
    order = np.concatenate(
        [np.sort(np.concatenate([s.arrival.order for s in p.streams.by_topic.values()])) for p in pieces]
    )
    assert (np.diff(order) > 0).all()
    assert [one for piece in pieces for one in piece.commands] == read_commands(bags / storage)


def test_a_count_of_messages_that_no_bag_can_hold_is_not_believed(bags: Path, tmp_path: Path) -> None:
    bag = tmp_path / "damaged"
    shutil.copytree(bags / "sqlite3", bag)
    metadata = bag / "metadata.yaml"
    count = len(read_streams(bag).imu.arrival)
    metadata.write_text(metadata.read_text().replace(f"message_count: {count}\n", f"message_count: {'9' * 400}\n"))
    with flight_pieces(bag, AIRCRAFT) as flight, pytest.warns(match="messages on /imu/data"):
        pieces = list(flight.pieces)
        assert flight.imu_messages / flight.messages < 1.0
    assert sum(len(piece.streams.imu.arrival) for piece in pieces) == count


def test_commands_read_in_place_of_positions_are_the_commands_too(bags: Path) -> None:
    topics = topic_names([f"actuators:={COMMANDS}"])
    whole = read_streams(bags / "mcap", topics)
    with flight_pieces(bags / "mcap", AIRCRAFT, topics, size=250) as flight:
        pieces = list(flight.pieces)
    parts = [piece.streams.actuators.positions for piece in pieces if len(piece.streams.actuators.arrival)]
    np.testing.assert_array_equal(np.concatenate(parts), whole.actuators.positions)
    assert [one for piece in pieces for one in piece.commands] == read_commands(bags / "mcap")


def test_joints_that_come_later_keep_the_places_of_the_earlier(tmp_path: Path) -> None:
    store, none = type_store(), np.zeros(0)
    write_streams(tmp_path / "base", made_streams(0.2))
    base = read_streams(tmp_path / "base")
    names = [("elevator",), ("aileron", "elevator")]
    with new_bag(tmp_path / "bag") as writer:
        for topic, kind in INPUT_TOPICS.items():
            connection = add_topic(writer, topic_names()[topic], kind)
            for k in range(2):
                head = header(store, "")
                if topic == "actuators":
                    message = store.types[kind](head, list(names[k]), np.array([0.1, 0.2][: k + 1]), none, none)
                elif topic == "air_data":
                    message = store.types[kind](head, 18.0, 0.0, 0.0, 1.2)
                else:
                    continue
                writer.write(connection, k, bytes(store.serialize_cdr(message, kind)))
    assert len(base.imu.arrival)
    with (
        pytest.raises(InputError, match="no messages on /imu/data"),
        flight_pieces(tmp_path / "bag", AIRCRAFT, size=1) as flight,
    ):
        found = []
        for piece in flight.pieces:
            found.append(piece.streams.actuators)
    assert [one.names for one in found if len(one.arrival)] == [("elevator",), ("elevator", "aileron")]
    np.testing.assert_array_equal(found[-1].positions, [[0.2, 0.1]])
