"""CDR messages by the thousand: where each number lies is worked out once for all messages of one layout.

A serialised message (OMG CDR, XCDR1: an encapsulation of 4 bytes, then every number aligned to its own size) is laid
out by its strings and the lengths of its sequences alone. Messages that agree in those bytes, which is checked for each
one, hold their numbers at the same places: NumPy reads and writes them through one structured type.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

_NUMBERS = {
    **{f"{kind}{8 * size}": f"{kind[0]}{size}" for kind in ("int", "uint", "float") for size in (1, 2, 4, 8)},
    **{"bool": "u1", "byte": "u1", "char": "u1"},
}
#: Layouts looked for among the messages of one length; what varies more is deserialised one by one.
_MAX_LAYOUTS = 16


@dataclass(frozen=True)
class Layout:
    """The places of a message's numbers, by dotted path: ``header.stamp.sec``, ``derivatives.3.value``."""

    template: bytes
    dtype: np.dtype[Any]  # structured; arrays and sequences of numbers are subarrays
    strings: Mapping[str, str]  # by dotted path
    fixed: NDArray[np.intp]  # positions of the bytes that decide the layout

    def matches(self, block: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Which of the messages (N, length) are laid out like this one, and hold the same strings."""
        wanted = np.frombuffer(self.template, np.uint8)[self.fixed]
        same: NDArray[np.bool_] = (block[:, self.fixed] == wanted).all(axis=1)
        return same


class Fields(Protocol):
    """Messages that share their strings, column by column."""

    def numbers(self, path: str) -> NDArray[Any]:
        """The number or array at a path, of each message: (n, ...)."""

    def strings(self, path: str) -> tuple[str, ...]:
        """The string, or sequence of strings, at a path."""


@dataclass(frozen=True)
class _Batch:
    """Fields of messages of one layout."""

    layout: Layout
    records: NDArray[Any]

    def numbers(self, path: str) -> NDArray[Any]:
        return self.records[path]

    def strings(self, path: str) -> tuple[str, ...]:
        return tuple(text for at, text in self.layout.strings.items() if at == path or at.startswith(f"{path}."))


@dataclass(frozen=True)
class _Single:
    """Fields of one message that rosbags deserialised."""

    message: object

    def numbers(self, path: str) -> NDArray[Any]:
        return np.asarray(attrgetter(path)(self.message))[np.newaxis]

    def strings(self, path: str) -> tuple[str, ...]:
        value = attrgetter(path)(self.message)
        return (value,) if isinstance(value, str) else tuple(value)


def decode(store: Typestore, msgtype: str, raw: Sequence[bytes]) -> Iterator[tuple[NDArray[np.intp], Fields]]:
    """All messages, in groups that share their strings: (positions in ``raw``, their fields).

    Raises rosbags' SerdeError where a message is damaged.
    """
    lengths = np.fromiter(map(len, raw), np.intp, len(raw))
    for length in np.unique(lengths):
        at = np.flatnonzero(lengths == length)
        same = raw if at.size == len(raw) else [raw[i] for i in at.tolist()]
        block = np.frombuffer(b"".join(same), np.uint8).reshape(at.size, length)
        yield from _decode_block(store, msgtype, at, block)


def _decode_block(
    store: Typestore, msgtype: str, at: NDArray[np.intp], block: NDArray[np.uint8]
) -> Iterator[tuple[NDArray[np.intp], Fields]]:
    """Messages of one length: layout after layout, then what is left one by one."""
    for _ in range(_MAX_LAYOUTS):
        if not at.size:
            return
        layout = layout_of(store, msgtype, block[0].tobytes())
        same = layout.matches(block)
        alike = block if same.all() else block[same]
        yield at[same], _Batch(layout, alike.view(layout.dtype)[:, 0])
        at, block = at[~same], block[~same]
    for i, message in zip(at, block, strict=True):
        yield np.array([i]), _Single(store.deserialize_cdr(message.tobytes(), msgtype))


def encode(layout: Layout, columns: Mapping[str, NDArray[Any]], count: int) -> list[bytes]:
    """``count`` messages like the layout's template, with the columns (count, ...) written into their paths."""
    length = len(layout.template)
    text = bytearray(layout.template * count)
    records = np.frombuffer(text, layout.dtype)  # shares the memory; a copy would lose the bytes between the numbers
    for path, values in columns.items():
        records[path] = values
    whole = bytes(text)
    return [whole[i : i + length] for i in range(0, count * length, length)]


def layout_of(store: Typestore, msgtype: str, raw: bytes, spare: bool = False) -> Layout:
    """The layout of one message. Raises rosbags' SerdeError where it is no whole message of the type.

    ``spare``: bytes may follow that mean nothing, as in a buffer that was larger than the message.
    """
    if len(raw) < 4 or raw[0] != 0 or raw[1] not in {0, 1}:
        raise SerdeError(f"{msgtype}: not a CDR message")
    walk = _Walk(store, raw, "<" if raw[1] else ">")
    try:
        walk.message(msgtype, "")
    except (ValueError, IndexError) as error:
        raise SerdeError(f"{msgtype}: the message is cut short or damaged") from error
    # Padding to a multiple of 4 may follow.
    if not spare and len(raw) >= walk.position + 4:
        raise SerdeError(f"{msgtype}: {len(raw)} bytes for a message of {walk.position}")
    spec: Any = {"names": walk.names, "formats": walk.formats, "offsets": walk.offsets, "itemsize": len(raw)}
    return Layout(raw, np.dtype(spec), walk.strings, np.array(walk.fixed, np.intp))


@dataclass
class _Walk:
    """A walk through one message along its definition."""

    store: Typestore
    raw: bytes
    order: str  # "<" or ">", as NumPy writes it
    position: int = 4
    names: list[str] = field(default_factory=list)
    formats: list[Any] = field(default_factory=list)
    offsets: list[int] = field(default_factory=list)
    strings: dict[str, str] = field(default_factory=dict)
    fixed: list[int] = field(default_factory=lambda: [0, 1])

    def message(self, msgtype: str, prefix: str) -> None:
        for name, description in self.store.fielddefs[msgtype][1]:
            self.value(description, f"{prefix}{name}")

    def value(self, description: FieldDesc, path: str) -> None:
        kind: Any = description[0]
        inner: Any = description[1]
        if kind == Nodetype.BASE and inner[0] == "string":
            self.strings[path] = self.string()
        elif kind == Nodetype.BASE:
            self.number(_NUMBERS[inner[0]], (), path)
        elif kind == Nodetype.NAME:
            self.message(inner, f"{path}.")
        else:
            element, count = inner
            self.array(element, count if kind == Nodetype.ARRAY else self.length(), path)

    def array(self, element: FieldDesc, count: int, path: str) -> None:
        inner: Any = element[1]
        if element[0] == Nodetype.BASE and inner[0] != "string":
            self.number(_NUMBERS[inner[0]], (count,), path)
            return
        for i in range(count):
            self.value(element, f"{path}.{i}")

    def number(self, code: str, shape: tuple[int, ...], path: str) -> None:
        size, count = int(code[1]), int(np.prod(shape, dtype=np.int64))
        if count:  # an empty sequence is not aligned
            self.align(size)
        self.names.append(path)
        self.formats.append((f"{self.order}{code}", shape))
        self.offsets.append(self.position)
        self.skip(size * count)

    def string(self) -> str:
        count = self.length()
        start = self.position
        self.skip(count)
        self.fixed.extend(range(start, start + count))
        return self.raw[start : start + max(count - 1, 0)].decode()

    def length(self) -> int:
        """The length that stands before a string or a sequence."""
        self.align(4)
        start = self.position
        self.skip(4)
        self.fixed.extend(range(start, start + 4))
        return int.from_bytes(self.raw[start : start + 4], "little" if self.order == "<" else "big")

    def align(self, size: int) -> None:
        self.position += -(self.position - 4) % size

    def skip(self, count: int) -> None:
        self.position += count
        if self.position > len(self.raw):
            raise ValueError("past the end")
