"""CDR messages one at a time, in flight: where a layout's numbers lie is remembered from the messages before.

What a node hears is laid out as the message before nearly always, and what it tells as well; then reading and writing
is a comparison of the bytes that decide the layout (see ``cdr_layout``) and one call, without an object for every part.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.cdr_layout import Definitions, Layout, layout_of

_CODES = {"f8": "d", "f4": "f", "i8": "q", "u8": "Q", "i4": "i", "u4": "I", "i2": "h", "u2": "H", "i1": "b", "u1": "B"}
#: Layouts remembered; messages that vary more are slower to read, and as right.
_REMEMBERED = 16

Text = str | tuple[str, ...]


class _Known(NamedTuple):
    """A layout that has been seen: what decides it, and where its numbers lie."""

    runs: tuple[tuple[int, int, bytes], ...]  # begin, end, bytes there
    numbers: struct.Struct
    texts: tuple[Text, ...]

    def fits(self, raw: bytes) -> bool:
        """Whether a message is laid out like this, with the same strings."""
        whole = len(raw) >= self.numbers.size
        return whole and all(raw[begin:end] == there for begin, end, there in self.runs)


class SingleReader:
    """Reads the numbers at ``numbers`` (dotted paths in the message's order) and the ``strings`` of single messages."""

    def __init__(
        self, definitions: Definitions, msgtype: str, numbers: Sequence[str], strings: Sequence[str] = ()
    ) -> None:
        self._definitions, self._type = definitions, msgtype
        self._numbers, self._strings = tuple(numbers), tuple(strings)
        self._known: deque[_Known] = deque(maxlen=_REMEMBERED)

    def read(self, raw: bytes) -> tuple[tuple[Any, ...], tuple[Text, ...]]:
        """All numbers, those of sequences one after the other, and the strings, those of sequences as tuples.

        Raises ``cdr_layout.DamageError`` where it is no whole message of the type.
        """
        for known in self._known:
            if known.fits(raw):
                return known.numbers.unpack_from(raw), known.texts
        known = self._learn(layout_of(self._definitions, self._type, raw, spare=True))
        self._known.appendleft(known)
        return known.numbers.unpack_from(raw), known.texts

    def _learn(self, layout: Layout) -> _Known:
        numbers = struct.Struct(_format(layout, self._numbers))
        texts = tuple(_text(layout, path) for path in self._strings)
        return _Known(tuple(_runs(layout)), numbers, texts)


class SingleWriter:
    """Writes messages like a layout's template: ``groups`` of paths, each of numbers of one kind, one call for each."""

    def __init__(self, layout: Layout, *groups: Sequence[str]) -> None:
        self._template, places = layout.template, [_places(layout, paths) for paths in groups]
        self._places = [(kind, (offsets[:, None] + np.arange(kind.itemsize)).ravel()) for kind, offsets in places]

    def write(self, *columns: NDArray[Any]) -> list[bytes]:
        """n messages; ``columns`` (n, numbers) of each group, those of arrays one after the other."""
        count, length = len(columns[0]), len(self._template)
        text = bytearray(self._template * count)
        block = np.frombuffer(text, np.uint8).reshape(count, length)
        for (kind, places), values in zip(self._places, columns, strict=True):
            block[:, places] = np.ascontiguousarray(values, kind).view(np.uint8)
        whole = bytes(text)
        return [whole[i : i + length] for i in range(0, count * length, length)]


def _format(layout: Layout, paths: Sequence[str]) -> str:
    """What ``struct`` calls the numbers at these paths, with what lies between them left out."""
    assert layout.dtype.fields is not None
    text, position = "", 0
    for path in paths:
        kind, offset, *_ = layout.dtype.fields[path]
        count = int(np.prod(kind.shape, dtype=np.int64))
        if count:
            text += f"{offset - position}x{count}{_CODES[kind.base.str[1:]]}"
            position = offset + kind.itemsize
    return f"{'<' if layout.template[1] else '>'}{text}"


def _places(layout: Layout, paths: Sequence[str]) -> tuple[np.dtype[Any], NDArray[np.intp]]:
    """The kind of the numbers at these paths, and where each begins."""
    assert layout.dtype.fields is not None
    fields = [layout.dtype.fields[path] for path in paths]
    (kind,) = {field[0].base for field in fields} or {np.dtype(np.float64)}
    begins = [np.arange(field[1], field[1] + field[0].itemsize, kind.itemsize) for field in fields]
    return kind, np.concatenate([np.empty(0, np.intp), *begins])


def _runs(layout: Layout) -> list[tuple[int, int, bytes]]:
    """The bytes that decide the layout, in as few pieces as they lie in."""
    fixed = sorted(layout.fixed.tolist())
    breaks = [0, *(i + 1 for i, (a, b) in enumerate(pairwise(fixed)) if b > a + 1), len(fixed)]
    pieces = [(fixed[a], fixed[b - 1] + 1) for a, b in pairwise(breaks)]
    return [(begin, end, layout.template[begin:end]) for begin, end in pieces]


def _text(layout: Layout, path: str) -> Text:
    if path in layout.strings:
        return layout.strings[path]
    return tuple(text for at, text in layout.strings.items() if at.startswith(f"{path}."))
