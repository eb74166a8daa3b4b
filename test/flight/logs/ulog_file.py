"""Writes small ULog files: by the format's description (docs.px4.io, ULog file format), then once more by pyulog."""

import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pyulog import ULog

Clock = Callable[[int], int]

_CODES = {"uint64_t": "Q", "float": "f", "int32_t": "i", "uint8_t": "B", "int8_t": "b", "bool": "?"}


class Topic(NamedTuple):
    """Samples: ``us`` (N,), and by field (``name`` or ``name[size]``) its type and column, (N,) or (N, size)."""

    name: str
    us: np.ndarray
    fields: Mapping[str, tuple[str, np.ndarray]]
    instance: int = 0


def write_ulog(
    path: Path,
    topics: list[Topic],
    parameters: Mapping[str, float],
    release: int,
    clock: Clock | None = None,
    vehicle: str = "",
) -> None:
    """A ULog file with all samples in the order of their times, written by pyulog; ``vehicle`` is its unique number.

    ``clock`` gives the stamp of a time; with one, the file is not passed through pyulog, which sorts by stamps.
    """
    body = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", int(min(t.us.min() for t in topics))))
    body += _message("B", bytes(40))
    body += _info("char[3] sys_name", b"PX4") + _info("uint32_t ver_sw_release", struct.pack("<I", release))
    if vehicle:
        body += _info(f"char[{len(vehicle)}] sys_uuid", vehicle.encode())
    for topic in {t.name: t for t in topics}.values():
        fields = "".join(f"{_declared(name, kind)};" for name, (kind, _) in topic.fields.items())
        body += _message("F", f"{topic.name}:uint64_t timestamp;{fields}".encode())
    for name, value in parameters.items():
        whole = isinstance(value, int)
        key = f"{'int32_t' if whole else 'float'} {name}".encode()
        body += _message("P", bytes([len(key)]) + key + struct.pack("<i" if whole else "<f", value))
    rows: list[tuple[int, bytes]] = []
    for number, topic in enumerate(topics):
        body += _message("A", struct.pack("<BH", topic.instance, number) + topic.name.encode())
        rows += [(int(us), row) for us, row in zip(topic.us, _rows(number, topic, clock or int), strict=True)]
    for _, row in sorted(rows, key=lambda one: one[0]):
        body += row
    path.write_bytes(body)
    if clock is None:
        ULog(str(path)).write_ulog(str(path))


def _declared(name: str, kind: str) -> str:
    bare, _, size = name.partition("[")
    return f"{kind}[{size} {bare}" if size else f"{kind} {bare}"


def _message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def _info(key: str, value: bytes) -> bytes:
    return _message("I", bytes([len(key)]) + key.encode() + value)


def _rows(number: int, topic: Topic, clock: Clock) -> list[bytes]:
    columns = [(_CODES[kind], np.atleast_2d(np.asarray(values).T).T) for kind, values in topic.fields.values()]
    layout = "<HQ" + "".join(code * values.shape[1] for code, values in columns)
    rows = []
    for i, us in enumerate(topic.us):
        cells = [cell for _, values in columns for cell in values[i].tolist()]
        rows.append(_message("D", struct.pack(layout, number, int(clock(us)), *cells)))
    return rows
