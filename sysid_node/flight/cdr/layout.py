"""Where a serialised message's numbers lie (OMG CDR, XCDR1), worked out along the definition of its type.

A message begins with an encapsulation of 4 bytes; every number is aligned to its own size. Its strings and the lengths
of its sequences alone decide how it is laid out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


class DamageError(ValueError):
    """Bytes that are no whole message of the type."""


@dataclass(frozen=True)
class Number:
    """A number by NumPy's code: f8, i4, u1."""

    code: str


@dataclass(frozen=True)
class String:
    """A string."""


@dataclass(frozen=True)
class Part:
    """A message within a message."""

    msgtype: str


@dataclass(frozen=True)
class Array:
    """``count`` elements, or a sequence of any number of them (None)."""

    element: Kind
    count: int | None


Kind = Number | String | Part | Array
#: The fields of a message type, by name and in order: ``sensor_msgs/msg/Imu`` -> (("header", Part(...)), ...).
Definitions = Callable[[str], Sequence[tuple[str, Kind]]]

#: Numbers as message definitions call them.
NUMBERS: Mapping[str, Number] = {
    **{f"{kind}{8 * size}": Number(f"{kind[0]}{size}") for kind in ("int", "uint", "float") for size in (1, 2, 4, 8)},
    **dict.fromkeys(("bool", "byte", "char"), Number("u1")),
}


#: What ``struct`` calls the numbers that NumPy calls so.
CODES: Mapping[str, str] = {
    **{"f8": "d", "i8": "q", "u8": "Q"},
    **{"f4": "f", "i4": "i", "u4": "I"},
    **{"i2": "h", "u2": "H", "i1": "b", "u1": "B"},
}


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


def layout_of(definitions: Definitions, msgtype: str, raw: bytes, spare: bool = False) -> Layout:
    """The layout of one message. Raises DamageError where it is no whole message of the type.

    ``spare``: bytes may follow that mean nothing, as in a buffer that was larger than the message; they are left out.
    """
    if len(raw) < 4 or raw[0] != 0 or raw[1] not in {0, 1}:
        raise DamageError(f"{msgtype}: not a CDR message")
    walk = _Walk(definitions, raw, "<" if raw[1] else ">")
    try:
        walk.message(msgtype, "")
    except (ValueError, IndexError) as error:
        raise DamageError(f"{msgtype}: the message is cut short or damaged") from error
    if spare:
        raw = raw[: walk.position]
    # Padding to a multiple of 4 may follow.
    if len(raw) >= walk.position + 4:
        raise DamageError(f"{msgtype}: {len(raw)} bytes for a message of {walk.position}")
    spec: Any = {"names": walk.names, "formats": walk.formats, "offsets": walk.offsets, "itemsize": len(raw)}
    return Layout(raw, np.dtype(spec), walk.strings, np.array(walk.fixed, np.intp))


@dataclass
class _Walk:
    """A walk through one message along its definition."""

    definitions: Definitions
    raw: bytes
    order: str  # "<" or ">", as NumPy writes it
    position: int = 4
    names: list[str] = field(default_factory=list)
    formats: list[Any] = field(default_factory=list)
    offsets: list[int] = field(default_factory=list)
    strings: dict[str, str] = field(default_factory=dict)
    fixed: list[int] = field(default_factory=lambda: [0, 1])

    def message(self, msgtype: str, prefix: str) -> None:
        for name, kind in self.definitions(msgtype):
            self.value(kind, f"{prefix}{name}")

    def value(self, kind: Kind, path: str) -> None:
        if isinstance(kind, String):
            self.strings[path] = self.string()
        elif isinstance(kind, Number):
            self.number(kind.code, (), path)
        elif isinstance(kind, Part):
            self.message(kind.msgtype, f"{path}.")
        else:
            self.array(kind.element, self.length() if kind.count is None else kind.count, path)

    def array(self, element: Kind, count: int, path: str) -> None:
        if isinstance(element, Number):
            self.number(element.code, (count,), path)
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
