"""Serialised messages whose strings are given and whose numbers are written later, one message or thousands.

Strings and lengths alone decide where a message's numbers lie (see ``cdr_layout``). Where these change now and then, as
the statuses of estimates do, most parts of the message are as before: each part is serialised once for each place,
modulo the largest alignment, at which it begins, and put together with the others from then on.
"""

from __future__ import annotations

import struct
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.cdr.layout import CODES, Array, Definitions, Kind, Number, Part, String

_HEAD = b"\0\1\0\0"  # CDR, little-endian
_ALIGNMENT = 8
_REMEMBERED = 4096  # parts

#: A message's values in the order of its fields; those of parts and sequences are tuples again.
Values = tuple[Hashable, ...]


@dataclass(frozen=True)
class Template:
    """A serialised message, and where its numbers lie."""

    text: bytes
    places: Mapping[str, NDArray[np.intp]]  # by kind (f8, i4, ...): of each number's bytes, in the message's order

    def write(self, **columns: NDArray[Any]) -> list[bytes]:
        """n messages like this one, with ``columns`` (n, numbers) by kind; numbers of other kinds stay as they are."""
        count, length = len(next(iter(columns.values()))), len(self.text)
        whole = bytearray(self.text * count)
        block = np.frombuffer(whole, np.uint8).reshape(count, length)
        for kind, values in columns.items():
            block[:, self.places[kind]] = np.ascontiguousarray(values, f"<{kind}").view(np.uint8)
        text = bytes(whole)
        return [text[i : i + length] for i in range(0, count * length, length)]


class Templates:
    """Makes templates of the types in ``definitions``."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._part = lru_cache(_REMEMBERED)(self._serialise)

    def template(self, msgtype: str, values: Values) -> Template:
        """A template with these values."""
        whole = self._part(msgtype, values, 0)
        found: dict[str, list[int]] = {}
        for kind, place in whole.numbers:
            found.setdefault(kind, []).append(place + len(_HEAD))
        places = {kind: (np.array(begins)[:, None] + np.arange(int(kind[1]))).ravel() for kind, begins in found.items()}
        return Template(_HEAD + whole.text, places)

    def _serialise(self, msgtype: str, values: Values, phase: int) -> _Piece:
        """A part that begins ``phase`` bytes past a multiple of the largest alignment."""
        writing = _Writing(self, phase)
        for (_, kind), value in zip(self._definitions(msgtype), values, strict=True):
            writing.put(kind, value)
        return _Piece(bytes(writing.text[phase:]), tuple(writing.numbers))

    def part(self, msgtype: str, values: Values, phase: int) -> _Piece:
        """The same, remembered."""
        return self._part(msgtype, values, phase)


@dataclass(frozen=True)
class _Piece:
    """A part's bytes, and the kind and place of each of its numbers."""

    text: bytes
    numbers: tuple[tuple[str, int], ...]


class _Writing:
    """A part that is being serialised; what lies before it stands for where it begins."""

    def __init__(self, templates: Templates, phase: int) -> None:
        self.text, self.numbers = bytearray(phase), list[tuple[str, int]]()
        self._templates, self._phase = templates, phase

    def put(self, kind: Kind, value: Any) -> None:
        """Serialise one value."""
        if isinstance(kind, Number):
            self._align(int(kind.code[1]))
            self.numbers.append((kind.code, len(self.text) - self._phase))
            self.text += struct.pack(f"<{CODES[kind.code]}", value)
        elif isinstance(kind, String):
            data = value.encode() + b"\0"
            self._length(len(data))
            self.text += data
        elif isinstance(kind, Part):
            piece = self._templates.part(kind.msgtype, value, len(self.text) % _ALIGNMENT)
            begin = len(self.text) - self._phase
            self.numbers += [(code, begin + place) for code, place in piece.numbers]
            self.text += piece.text
        else:
            self._array(kind, value)

    def _array(self, kind: Array, values: Any) -> None:
        if kind.count is None:
            self._length(len(values))
        for value in values:
            self.put(kind.element, value)

    def _length(self, count: int) -> None:
        self._align(4)
        self.text += struct.pack("<I", count)

    def _align(self, size: int) -> None:
        self.text += bytes(-len(self.text) % size)
