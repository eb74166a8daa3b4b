"""Reads serialised messages one at a time, for the nodes in flight.

Nearly every message of a topic has the layout of one before it. To read it is then a comparison of the bytes that
decide the layout and one call of ``struct``, without an object for each part of the message.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from sysid_node.flight.cdr.layout import STRUCT_CODES, Definitions, MessageLayout, layout_of

#: Layouts that are remembered. Messages with more layouts than this are read correctly, but slowly.
_REMEMBERED = 16

Text = str | tuple[str, ...]


class _KnownLayout(NamedTuple):
    """A layout that was met before: the bytes that decide it, and where the wanted numbers lie."""

    runs: tuple[tuple[int, int, bytes], ...]  # begin, end, and the bytes between them
    numbers: struct.Struct
    texts: tuple[Text, ...]

    def fits(self, raw: bytes) -> bool:
        """Whether a message has this layout and the same strings."""
        long_enough = len(raw) >= self.numbers.size
        return long_enough and all(raw[begin:end] == wanted for begin, end, wanted in self.runs)


class MessageReader:
    """Reads the numbers at the dotted paths ``numbers`` (in the message's order) and the texts at ``strings``."""

    def __init__(
        self, definitions: Definitions, msgtype: str, numbers: Sequence[str], strings: Sequence[str] = ()
    ) -> None:
        self._definitions, self._type = definitions, msgtype
        self._numbers, self._strings = tuple(numbers), tuple(strings)
        self._known: deque[_KnownLayout] = deque(maxlen=_REMEMBERED)

    def read(self, raw: bytes) -> tuple[tuple[Any, ...], tuple[Text, ...]]:
        """All numbers, those of a sequence one after the other, and the texts, a tuple for a sequence of strings.

        Bytes after the message's end are ignored, as ROS's buffers may be larger than the message. Raises
        ``layout.DamageError`` where ``raw`` is no whole message of the type.
        """
        for known in self._known:
            if known.fits(raw):
                return known.numbers.unpack_from(raw), known.texts
        known = self._learn(layout_of(self._definitions, self._type, raw, spare=True))
        self._known.appendleft(known)
        return known.numbers.unpack_from(raw), known.texts

    def _learn(self, layout: MessageLayout) -> _KnownLayout:
        numbers = struct.Struct(_struct_format(layout, self._numbers))
        texts = tuple(_text(layout, path) for path in self._strings)
        return _KnownLayout(tuple(_runs(layout)), numbers, texts)


def _struct_format(layout: MessageLayout, paths: Sequence[str]) -> str:
    """The format by which ``struct`` reads the numbers at these paths and skips the bytes between them."""
    assert layout.dtype.fields is not None
    text, position = "", 0
    for path in paths:
        kind, offset, *_ = layout.dtype.fields[path]
        count = int(np.prod(kind.shape, dtype=np.int64))
        if count:
            text += f"{offset - position}x{count}{STRUCT_CODES[kind.base.str[1:]]}"
            position = offset + kind.itemsize
    return f"{'<' if layout.template[1] else '>'}{text}"


def _runs(layout: MessageLayout) -> list[tuple[int, int, bytes]]:
    """The bytes that decide the layout, as the fewest contiguous pieces: begin, end, and the bytes between them."""
    fixed = sorted(layout.fixed.tolist())
    breaks = [0, *(i + 1 for i, (a, b) in enumerate(pairwise(fixed)) if b > a + 1), len(fixed)]
    pieces = [(fixed[a], fixed[b - 1] + 1) for a, b in pairwise(breaks)]
    return [(begin, end, layout.template[begin:end]) for begin, end in pieces]


def _text(layout: MessageLayout, path: str) -> Text:
    return layout.strings[path] if path in layout.strings else layout.texts(path)
