"""Raw messages by topic. Truth: what was written into the bag."""

import struct
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer

from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.raw_messages import read_messages

TOPICS = ("/a", "/b", "/c")
Message = tuple[int, str, bytes]  # log time (ns), topic, bytes


def write_bag(
    folder: Path, storage: StoragePlugin, compression: CompressionMode | None, seed: int = 0
) -> list[Message]:
    """Four megabytes, over several chunks, logged out of order and often at the same time."""
    rng = np.random.default_rng(seed)
    writer = Writer(folder, version=9, storage_plugin=storage)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    written: list[Message] = []
    with writer:
        topics = [writer.add_connection(topic, "std_msgs/msg/String", typestore=type_store()) for topic in TOPICS]
        for k in range(400):
            at, i = 1000 + k // 3 + int(rng.integers(-60, 60)), int(rng.integers(3))
            written.append((at, TOPICS[i], struct.pack("<I", k) + bytes(int(rng.integers(20_000)))))
            writer.write(topics[i], at, written[-1][2])
    return written


@pytest.mark.parametrize(
    ("storage", "compression"),
    [
        (StoragePlugin.MCAP, None),
        (StoragePlugin.MCAP, CompressionMode.STORAGE),
        (StoragePlugin.MCAP, CompressionMode.FILE),
        (StoragePlugin.MCAP, CompressionMode.MESSAGE),
        (StoragePlugin.SQLITE3, None),
        (StoragePlugin.SQLITE3, CompressionMode.FILE),
        (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    ],
    ids=str,
)
@pytest.mark.parametrize("topics", [TOPICS, ("/c", "/a")], ids=str)
def test_messages_are_those_that_were_written_in_the_order_of_their_log_times(
    tmp_path: Path, topics: tuple[str, ...], storage: StoragePlugin, compression: CompressionMode | None
) -> None:
    written = write_bag(tmp_path / "bag", storage, compression)
    with Reader(tmp_path / "bag") as reader:
        found = read_messages(reader, {t: [c for c in reader.connections if c.topic == t] for t in topics})
    listed = [
        (place, log_ns, topic, raw)
        for topic, messages in found.items()
        for place, log_ns, raw in zip(messages.order.tolist(), messages.log_ns.tolist(), messages.data, strict=True)
    ]
    assert sorted(message for _, *message in listed) == sorted([*m] for m in written if m[1] in topics)
    assert sorted(place for place, *_ in listed) == list(range(len(listed)))
    assert all(a[1] <= b[1] for a, b in zip(sorted(listed), sorted(listed)[1:], strict=False))
    assert all((np.diff(messages.order) > 0).all() for messages in found.values())


def test_a_topic_without_connections_has_no_messages(tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", StoragePlugin.SQLITE3, None)
    with Reader(tmp_path / "bag") as reader:
        assert read_messages(reader, {"/d": []})["/d"].data == []
