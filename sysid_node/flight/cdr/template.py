"""Writes serialised messages whose strings are known in advance and whose numbers are filled in later.

Where the numbers of a message lie depends on its strings and lengths alone (see ``layout``). When these change in
flight, as the statuses of estimates do, most parts of the message stay as they were. Each part is therefore serialised
once for every alignment at which it can begin, remembered, and joined with the others.
"""

from __future__ import annotations

import struct
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.cdr.layout import STRUCT_CODES, Array, Definitions, Kind, Number, Part, String

_ENCAPSULATION = b"\0\1\0\0"  # plain CDR, little-endian
_ALIGNMENT = 8  # bytes, the largest of any number
_REMEMBERED = 4096  # parts

#: A message's values in the order of its fields; those of parts and of sequences are tuples in turn.
Values = tuple[Hashable, ...]


@dataclass(frozen=True)
class Template:
    """A serialised message, and where its numbers lie."""

    text: bytes
    places: Mapping[str, NDArray[np.intp]]  # NumPy's code (f8, i4, ...) -> places of the numbers' bytes, in order

    def write(self, **columns: NDArray[Any]) -> list[bytes]:
        """n messages like this one with ``columns`` (n, numbers) by NumPy's code; numbers of other codes are kept."""
        count, length = len(next(iter(columns.values()))), len(self.text)
        whole = bytearray(self.text * count)
        block = np.frombuffer(whole, np.uint8).reshape(count, length)
        for kind, values in columns.items():
            block[:, self.places[kind]] = np.ascontiguousarray(values, f"<{kind}").view(np.uint8)
        text = bytes(whole)
        return [text[i : i + length] for i in range(0, count * length, length)]


class Templates:
    """Makes templates of the message types in ``definitions``."""

    def __init__(self, definitions: Definitions) -> None:
        self._definitions = definitions
        self._part = lru_cache(_REMEMBERED)(self._serialise)

    def template(self, msgtype: str, values: Values) -> Template:
        """The template of a message with these values."""
        message = self._part(msgtype, values, 0)
        begins: dict[str, list[int]] = {}
        for kind, place in message.numbers:
            begins.setdefault(kind, []).append(place + len(_ENCAPSULATION))
        places = {kind: (np.array(begin)[:, None] + np.arange(int(kind[1]))).ravel() for kind, begin in begins.items()}
        return Template(_ENCAPSULATION + message.text, places)

    def part(self, msgtype: str, values: Values, phase: int) -> SerialisedPart:
        """A message, or a part of one, that begins ``phase`` bytes after a multiple of the largest alignment."""
        return self._part(msgtype, values, phase)

    def _serialise(self, msgtype: str, values: Values, phase: int) -> SerialisedPart:
        serialisation = _Serialisation(self, phase)
        for (_, kind), value in zip(self._definitions(msgtype), values, strict=True):
            serialisation.put(kind, value)
        return SerialisedPart(bytes(serialisation.text[phase:]), tuple(serialisation.numbers))


@dataclass(frozen=True)
class SerialisedPart:
    """The bytes of a part of a message, and the code and place of each of its numbers."""

    text: bytes
    numbers: tuple[tuple[str, int], ...]


class _Serialisation:
    """A part that is being serialised, after ``phase`` bytes that stand for what precedes it in the message."""

    def __init__(self, templates: Templates, phase: int) -> None:
        self.text, self.numbers = bytearray(phase), list[tuple[str, int]]()
        self._templates, self._phase = templates, phase

    def put(self, kind: Kind, value: Any) -> None:
        """Append one value."""
        if isinstance(kind, Number):
            self._align(int(kind.code[1]))
            self.numbers.append((kind.code, len(self.text) - self._phase))
            self.text += struct.pack(f"<{STRUCT_CODES[kind.code]}", value)
        elif isinstance(kind, String):
            data = value.encode() + b"\0"
            self._length(len(data))
            self.text += data
        elif isinstance(kind, Part):
            part = self._templates.part(kind.msgtype, value, len(self.text) % _ALIGNMENT)
            begin = len(self.text) - self._phase
            self.numbers += [(code, begin + place) for code, place in part.numbers]
            self.text += part.text
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
