"""Messages read chunk by chunk, or row by row, are those that rosbags yields one by one, in the same order."""

import struct
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer

from sysid_node.flight.bag import raw_messages
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.raw_messages import read_messages
from sysid_node.flight.cdr.layout import DamageError

TOPICS = ("/a", "/b", "/c")


def bag(
    folder: Path,
    compression: CompressionMode | None = None,
    seed: int = 0,
    storage: StoragePlugin = StoragePlugin.MCAP,
) -> Path:
    """Four megabytes, over several chunks, logged out of order and often at the same time."""
    rng = np.random.default_rng(seed)
    writer = Writer(folder, version=9, storage_plugin=storage)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        topics = [writer.add_connection(topic, "std_msgs/msg/String", typestore=type_store()) for topic in TOPICS]
        for k in range(400):
            at = 1000 + k // 3 + int(rng.integers(-60, 60))
            writer.write(topics[int(rng.integers(3))], at, struct.pack("<I", k) + bytes(int(rng.integers(20_000))))
    return folder


def assert_as_rosbags_reads(path: Path, topics: tuple[str, ...]) -> None:
    with Reader(path) as reader:
        chosen = {topic: [c for c in reader.connections if c.topic == topic] for topic in topics}
        found = read_messages(reader, chosen)
        every = [c for connections in chosen.values() for c in connections]
        expected = [(c.topic, log_ns, raw) for c, log_ns, raw in reader.messages(every)]
    listed = [
        (place, topic, log_ns, raw)
        for topic, some in found.items()
        for place, log_ns, raw in zip(some.order.tolist(), some.log_ns.tolist(), some.data, strict=True)
    ]
    assert [row[1:] for row in sorted(listed)] == expected
    assert all((np.diff(some.order) > 0).all() for some in found.values())


@pytest.mark.parametrize(
    "compression", [None, CompressionMode.STORAGE, CompressionMode.FILE, CompressionMode.MESSAGE], ids=str
)
@pytest.mark.parametrize("topics", [TOPICS, ("/c", "/a")], ids=str)
def test_chunks_hold_what_rosbags_yields(
    tmp_path: Path, topics: tuple[str, ...], compression: CompressionMode | None
) -> None:
    assert_as_rosbags_reads(bag(tmp_path / "bag", compression), topics)


@pytest.mark.parametrize("compression", [None, CompressionMode.FILE, CompressionMode.MESSAGE], ids=str)
@pytest.mark.parametrize("topics", [TOPICS, ("/c", "/a")], ids=str)
def test_rows_hold_what_rosbags_yields(
    tmp_path: Path, topics: tuple[str, ...], compression: CompressionMode | None
) -> None:
    assert_as_rosbags_reads(bag(tmp_path / "bag", compression, storage=StoragePlugin.SQLITE3), topics)


def test_a_file_alone(tmp_path: Path) -> None:
    assert_as_rosbags_reads(next(bag(tmp_path / "bag").glob("*.mcap")), TOPICS)


def test_no_message_is_made_of_a_record_that_is_cut_short() -> None:
    record = struct.pack("<BQHIQQ", 5, 22 + 8, 1, 0, 7, 7) + b"12345678"
    read: tuple[list[int], list[int], list[bytes]] = ([], [], [])
    raw_messages._read_chunk(record + b"\x03" + struct.pack("<Q", 0), {1: 4}, *read)
    assert read == ([4], [7], [b"12345678"])
    with pytest.raises(DamageError):
        raw_messages._read_chunk(record[:-1], {1: 4}, *read)
