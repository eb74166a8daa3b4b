"""CDR messages by the thousand: where each number lies is worked out once for all messages of one layout.

A message's strings and the lengths of its sequences alone decide how it is laid out. Messages that agree in those
bytes, which is checked for each one, hold their numbers at the same places: NumPy reads and writes them through one
structured type.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.store import Typestore

from sysid_node.flight.cdr.layout import NUMBERS, Array, Definitions, Kind, Layout, Part, String, layout_of

#: Layouts looked for among the messages of one length; what varies more is deserialised one by one.
_MAX_LAYOUTS = 16


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

    Raises DamageError, or rosbags' SerdeError, where a message is damaged.
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
        layout = layout_of(definitions_of(store), msgtype, block[0].tobytes())
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


@cache
def definitions_of(store: Typestore) -> Definitions:
    """The definitions that a store knows."""

    @cache
    def fields(msgtype: str) -> Sequence[tuple[str, Kind]]:
        return [(name, _kind(description)) for name, description in store.fielddefs[msgtype][1]]

    return fields


def _kind(description: FieldDesc) -> Kind:
    """What rosbags says of a field."""
    node: Any = description[0]
    inner: Any = description[1]
    if node == Nodetype.BASE:
        return String() if inner[0] == "string" else NUMBERS[inner[0]]
    if node == Nodetype.NAME:
        return Part(inner)
    element, count = inner
    return Array(_kind(element), count if node == Nodetype.ARRAY else None)
