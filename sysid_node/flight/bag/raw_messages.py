"""The messages of an open bag, as bytes: mcap files chunk by chunk, sqlite3 files row by row, others through rosbags.

rosbags goes through a chunk as through a file, number by number, which takes four times as long, and hands each row of
a table through two generators, which takes twice as long.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.reader import DirectoryReader
from rosbags.rosbag2.storage_mcap import ChunkInfo, McapReader, decompress
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from sysid_node.flight.cdr.layout import DamageError
from sysid_node.flight.streams import Stamps

_MESSAGE = 0x05  # what a message's record begins with
_RECORD = struct.Struct("<BQHIQQ")  # kind and length; channel, sequence, log time, time of publication
_LENGTH_ENDS = 9
_CRC, _NAME = 33, 49  # where a chunk's checksum and the name of its compression stand in its record
_ROWS = "SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp"


class Messages(NamedTuple):
    """One topic's messages in log order."""

    data: Sequence[bytes]
    log_ns: Stamps  # (N,)
    order: Stamps  # (N,) place among the messages of all topics that are read


def read_messages(reader: Reader, chosen: Mapping[str, Sequence[Connection]]) -> dict[str, Messages]:
    """The messages of the ``chosen`` connections by topic.

    Raises DamageError, or what rosbags raises, where the file is damaged.
    """
    files = _files(reader)
    found = _by_files(files, chosen) if files else _by_rosbags(reader, chosen)
    return dict(zip(chosen, found, strict=True))


def _by_rosbags(reader: Reader, chosen: Mapping[str, Sequence[Connection]]) -> Iterator[Messages]:
    lists: dict[int, tuple[list[bytes], list[int], list[int]]] = {}
    into = [lists.setdefault(connections[0].id, ([], [], [])) for connections in chosen.values()]
    for some, connections in zip(into, chosen.values(), strict=True):
        lists |= dict.fromkeys((connection.id for connection in connections), some)
    every = [connection for connections in chosen.values() for connection in connections]
    for place, (connection, log_ns, message) in enumerate(reader.messages(every)):
        data, logs, order = lists[connection.id]
        data.append(message)
        logs.append(log_ns)
        order.append(place)
    return (Messages(data, np.array(logs, np.int64), np.array(order, np.int64)) for data, logs, order in into)


def _files(reader: Reader) -> list[McapReader | Sqlite3Reader]:
    """The files of the bag; none where rosbags must read any of them, or where single messages are compressed."""
    storage = reader.storage
    files = storage.storages if isinstance(storage, DirectoryReader) else [storage]
    known = [
        file for file in files if isinstance(file, Sqlite3Reader) or (isinstance(file, McapReader) and file.chunks)
    ]
    return known if len(known) == len(files) and reader.compression_mode != "message" else []


def _by_files(
    files: Sequence[McapReader | Sqlite3Reader], chosen: Mapping[str, Sequence[Connection]]
) -> Iterator[Messages]:
    """One file after the other, as rosbags does; messages of one file by log time, at equal times as they lie."""
    topics: list[int] = []
    logs: list[int] = []
    data: list[bytes] = []
    order = np.empty(0, np.intp)
    places = {connections[0].topic: i for i, connections in enumerate(chosen.values())}
    for file in files:
        into = {c.id: places[c.topic] for c in file.connections if c.topic in places}
        if isinstance(file, Sqlite3Reader):
            _read_rows(file, into, topics, logs, data)
        else:
            for chunk in file.chunks:
                _read_chunk(_content(file, chunk), into, topics, logs, data)
        fresh = np.argsort(np.array(logs[order.size :], np.int64), kind="stable")
        order = np.append(order, order.size + fresh)
    topic, log_ns = np.array(topics, np.int64)[order], np.array(logs, np.int64)[order]
    for i in range(len(chosen)):
        at = np.flatnonzero(topic == i)
        yield Messages([data[k] for k in order[at].tolist()], log_ns[at], at)


def _read_rows(
    file: Sqlite3Reader, into: Mapping[int, int], topics: list[int], logs: list[int], data: list[bytes]
) -> None:
    """Append the messages of the topics by number ``into`` ours."""
    assert file.dbconn is not None
    for topic, log_ns, message in file.dbconn.execute(_ROWS):
        if topic in into:
            topics.append(into[topic])
            logs.append(log_ns)
            data.append(message)


def _content(file: McapReader, chunk: ChunkInfo) -> bytes:
    """A chunk's records."""
    assert file.bio is not None
    begin = file.bio.seek(chunk.chunk_start_offset)
    record = file.bio.read(_NAME + len(chunk.compression) + chunk.compressed_size)
    crc = int.from_bytes(record[_CRC : _CRC + 4], "little")
    if len(record) < _NAME + len(chunk.compression) + chunk.compressed_size:
        raise DamageError(f"the chunk at byte {begin} is cut short")
    packed = record[_NAME + len(chunk.compression) :]
    return decompress(packed, chunk.compression, chunk.uncompressed_size, crc)


def _read_chunk(content: bytes, into: Mapping[int, int], topics: list[int], logs: list[int], data: list[bytes]) -> None:
    """Append the messages of the channels ``into`` topics."""
    end, at, read = len(content), 0, _RECORD.unpack_from
    content += bytes(_RECORD.size)  # the last record may be shorter than a message's
    while at < end:
        kind, length, channel, _, log_ns, _ = read(content, at)
        begin, at = at + _RECORD.size, at + _LENGTH_ENDS + length
        if kind == _MESSAGE and channel in into:
            topics.append(into[channel])
            logs.append(log_ns)
            data.append(content[begin:at])
    if at != end:
        raise DamageError("a chunk's last record is cut short")
