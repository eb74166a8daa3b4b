"""CDR messages one at a time, in flight: where a layout's numbers lie is remembered from the messages before.

What a node hears is laid out as the message before nearly always; then reading is a comparison of the bytes that decide
the layout (see ``cdr_layout``) and one call, without an object for every part. What it tells: see ``cdr_template``.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from sysid_node.flight.cdr.layout import CODES, Definitions, Layout, layout_of

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


def _format(layout: Layout, paths: Sequence[str]) -> str:
    """What ``struct`` calls the numbers at these paths, with what lies between them left out."""
    assert layout.dtype.fields is not None
    text, position = "", 0
    for path in paths:
        kind, offset, *_ = layout.dtype.fields[path]
        count = int(np.prod(kind.shape, dtype=np.int64))
        if count:
            text += f"{offset - position}x{count}{CODES[kind.base.str[1:]]}"
            position = offset + kind.itemsize
    return f"{'<' if layout.template[1] else '>'}{text}"


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
