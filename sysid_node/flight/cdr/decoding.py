"""Decodes the serialised messages of a topic together, as columns of numbers.

Messages of the same layout hold their numbers at the same places, so that one structured NumPy type reads them all
without a loop over messages. That a message has the layout is checked byte by byte for each one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.cdr.layout import Definitions, MessageLayout, layout_of

#: Layouts that are searched for among the messages of one length. The rest are decoded one by one, each by a layout of
#: its own: a search for every layout would take a time that grows with the square of their number.
_MAX_LAYOUTS = 16


@dataclass(frozen=True)
class DecodedMessages:
    """The fields of n messages that share their strings, by dotted path."""

    layout: MessageLayout
    records: NDArray[Any]  # (n,) structured

    def numbers(self, path: str) -> NDArray[Any]:
        """The number, or array of numbers, at a path in each message: (n, ...)."""
        return self.records[path]

    def strings(self, path: str) -> tuple[str, ...]:
        """The string, or sequence of strings, at a path."""
        return self.layout.texts(path)


def decode(
    definitions: Definitions, msgtype: str, raw: Sequence[bytes]
) -> Iterator[tuple[NDArray[np.intp], DecodedMessages]]:
    """All messages, in groups that share their strings: their positions in ``raw`` and their fields.

    Raises DamageError where a message is damaged.
    """
    lengths = np.fromiter(map(len, raw), np.intp, len(raw))
    for length in np.unique(lengths):
        at = np.flatnonzero(lengths == length)
        of_length = raw if at.size == len(raw) else [raw[i] for i in at.tolist()]
        block = np.frombuffer(b"".join(of_length), np.uint8).reshape(at.size, length)
        yield from _decode_block(definitions, msgtype, at, block)


def _decode_block(
    definitions: Definitions, msgtype: str, at: NDArray[np.intp], block: NDArray[np.uint8]
) -> Iterator[tuple[NDArray[np.intp], DecodedMessages]]:
    """Messages of one length (n, length): one layout after the other, then the remaining messages one by one."""
    for _ in range(_MAX_LAYOUTS):
        if not at.size:
            return
        layout = layout_of(definitions, msgtype, block[0].tobytes())
        matching = layout.matches(block)
        alike = block if matching.all() else block[matching]
        yield at[matching], DecodedMessages(layout, alike.view(layout.dtype)[:, 0])
        at, block = at[~matching], block[~matching]
    for i in range(at.size):
        layout = layout_of(definitions, msgtype, block[i].tobytes())
        yield at[i : i + 1], DecodedMessages(layout, block[i : i + 1].view(layout.dtype)[:, 0])
