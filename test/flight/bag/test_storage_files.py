"""What would be believed of a bag's files: other flights, missing messages, damaged chunks, clocks that jump."""

import dataclasses
import re
import sqlite3
import struct
import warnings
from zlib import crc32

import numpy as np
import pytest
from made_flights import made_streams

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.storage_files import CHUNK_LIMIT, chunks
from sysid_node.flight.bag.writer import write_streams


@pytest.mark.parametrize("name", ["100%41", "what?", "no#1", "a b", "ä%zz"])
@pytest.mark.parametrize("alone", [False, True])
def test_a_database_is_read_whatever_its_folder_is_called(tmp_path, name, alone):
    """Another flight lies where the name leads if it is taken for a URI: ``100%41`` for ``100A``."""
    for folder, seed in ((name, 1), ("100A", 2), ("what", 3), ("no", 4)):
        write_streams(tmp_path / folder / "flight", made_streams(0.5, seed), "sqlite3")
    path = tmp_path / name / "flight"
    read = read_streams(path / "flight.db3" if alone else path)
    np.testing.assert_array_equal(read.imu.values, made_streams(0.5, 1).imu.values)


def test_a_database_file_with_such_a_name_is_read_alone_and_refused_in_a_bag(tmp_path):
    write_streams(tmp_path / "flight", made_streams(0.5), "sqlite3")
    odd = (tmp_path / "flight" / "flight.db3").rename(tmp_path / "flight" / "fl%69ght.db3")
    np.testing.assert_array_equal(read_streams(odd).imu.values, made_streams(0.5).imu.values)
    with pytest.raises(InputError, match="rename it"):
        read_streams(tmp_path / "flight")


def test_messages_in_the_log_beside_a_database_are_not_lost_without_a_word(tmp_path):
    write_streams(tmp_path / "flight", made_streams(0.5), "sqlite3")
    database = sqlite3.connect(tmp_path / "flight" / "flight.db3")
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("INSERT INTO messages SELECT NULL, topic_id, timestamp, data FROM messages")
    database.commit()
    with pytest.raises(InputError, match=r"flight.db3-wal beside it holds messages.*wal_checkpoint"):
        read_streams(tmp_path / "flight")
    database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    database.close()
    assert len(read_streams(tmp_path / "flight").imu.arrival) == 2 * len(made_streams(0.5).imu.arrival)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_metadata_that_promises_more_than_is_there(tmp_path, storage):
    write_streams(tmp_path / "flight", made_streams(1.0), storage)
    metadata = tmp_path / "flight" / "metadata.yaml"
    count = len(made_streams(1.0).imu.arrival)
    text = metadata.read_text()
    assert f"message_count: {count}\n" in text
    metadata.write_text(text.replace(f"message_count: {count}\n", f"message_count: {count + 7}\n"))
    with pytest.warns(InputWarning, match=rf"7 of {count + 7} messages on /imu/data .* are not in it"):
        read_streams(tmp_path / "flight")


def test_a_sound_bag_gives_no_warning(tmp_path):
    written = made_streams(1.0)
    write_streams(tmp_path / "flight", written)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = read_streams(tmp_path / "flight")
    np.testing.assert_array_equal(read.imu.arrival.stamp_ns, written.imu.arrival.stamp_ns)


def test_chunks_carry_their_checksum_which_finds_one_wrong_bit(tmp_path):
    """Truth: the specification of MCAP, a CRC-32 of a chunk's records."""
    write_streams(tmp_path / "flight", made_streams(20.0))
    file = tmp_path / "flight" / "flight.mcap"
    content = bytearray(file.read_bytes())
    with file.open("rb") as stream:
        found = list(chunks(stream))
    assert len(found) > 1
    for chunk in found:
        stored = struct.unpack_from("<I", content, chunk.checksum_at)[0]
        assert stored == crc32(content[chunk.content_at : chunk.content_at + chunk.packed])
    content[found[0].content_at + found[0].packed // 2] ^= 1
    file.write_bytes(content)
    with pytest.raises(InputError, match="checksum"):
        read_streams(tmp_path / "flight")


def test_a_chunk_that_unpacks_to_more_than_is_bearable_is_refused_by_its_declared_size(tmp_path):
    write_streams(tmp_path / "flight", made_streams(1.0))
    file = tmp_path / "flight" / "flight.mcap"
    content = bytearray(file.read_bytes())
    with file.open("rb") as stream:
        chunk = next(chunks(stream))
    struct.pack_into("<Q", content, chunk.checksum_at - 8, 16 * 2**30)
    file.write_bytes(content)
    assert chunk.unpacked < CHUNK_LIMIT
    with pytest.raises(InputError, match=r"unpacks to 17180 MB, over 268 MB"):
        read_streams(tmp_path / "flight")


@pytest.mark.parametrize("jump", [56 * 365 * 86400, -3600])
def test_a_jump_of_the_recorders_clock_is_said(tmp_path, jump):
    streams = made_streams(2.0)
    late = streams.imu.arrival.order > streams.imu.arrival.order.max() / 2
    log = streams.imu.arrival.log_ns + np.where(late, jump * 10**9, 0) + 4000 * 10**9
    other = {
        topic: dataclasses.replace(
            stream, arrival=dataclasses.replace(stream.arrival, log_ns=stream.arrival.log_ns + 4000 * 10**9)
        )
        for topic, stream in (("air_data", streams.air_data), ("actuators", streams.actuators))
    }
    imu = dataclasses.replace(streams.imu, arrival=dataclasses.replace(streams.imu.arrival, log_ns=log))
    write_streams(tmp_path / "flight", dataclasses.replace(streams, imu=imu, **other))
    with pytest.warns(InputWarning, match=r"recorder's clock jumps by"):
        read_streams(tmp_path / "flight")


def test_joints_that_are_called_otherwise_in_each_message_are_refused(tmp_path):
    streams = made_streams(1.0)
    count = 1200
    names = tuple(f"joint {i}" for i in range(count))
    positions = np.zeros((len(streams.actuators.arrival), count))
    joints = dataclasses.replace(streams.actuators, names=names, positions=positions)
    write_streams(tmp_path / "flight", dataclasses.replace(streams, actuators=joints))
    with pytest.raises(InputError, match=r"1200 different joints in the messages, over 1000"):
        read_streams(tmp_path / "flight")


@pytest.mark.parametrize(
    "text", ["", "rosbag2_bagfile_information: 1", "[", "rosbag2_bagfile_information: {version: 99}"]
)
def test_metadata_that_is_damaged_can_be_made_again(tmp_path, text):
    write_streams(tmp_path / "flight", made_streams(0.5))
    (tmp_path / "flight" / "metadata.yaml").write_text(text)
    with pytest.raises(InputError, match="ros2 bag reindex") as caught:
        read_streams(tmp_path / "flight")
    assert not re.search("mcap recover|sqlite3", str(caught.value))


def test_a_csv_is_not_called_a_database(tmp_path):
    (tmp_path / "x.csv").write_text("t,ax\n")
    with pytest.raises(InputError, match="sysid convert") as caught:
        read_streams(tmp_path / "x.csv")
    assert "sqlite" not in str(caught.value)
