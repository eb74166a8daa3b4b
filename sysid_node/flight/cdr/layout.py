"""Where the numbers of a serialised message lie, found by a walk along the definition of its type.

The format is CDR (OMG Common Data Representation, plain CDR version 1, as in DDS-XTypes 1.3, section 7.4.3): 4 bytes of
encapsulation, then the fields in order, every number aligned to its own size. The strings and the lengths of the
sequences alone decide where the numbers lie, so that messages that agree in those bytes have one layout.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


class DamageError(ValueError):
    """Raised where bytes are not a whole message of the expected type."""


@dataclass(frozen=True)
class Number:
    """A number, by NumPy's code: f8, i4, u1."""

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


#: NumPy's codes of numbers -> those of the standard library's ``struct``.
STRUCT_CODES: Mapping[str, str] = {
    **{"f8": "d", "i8": "q", "u8": "Q"},
    **{"f4": "f", "i4": "i", "u4": "I"},
    **{"i2": "h", "u2": "H", "i1": "b", "u1": "B"},
}


@dataclass(frozen=True)
class MessageLayout:
    """Where a message's numbers lie, by dotted path: ``header.stamp.sec``, ``derivatives.3.value``."""

    template: bytes  # the message that the layout was found in
    dtype: np.dtype[Any]  # structured; arrays and sequences of numbers are subarrays
    strings: Mapping[str, str]  # by dotted path; those of a sequence by its path and their place: ``name.0``
    fixed: NDArray[np.intp]  # positions of the bytes that decide the layout

    def texts(self, path: str) -> tuple[str, ...]:
        """The string, or all strings of the sequence, at a path."""
        return tuple(text for at, text in self.strings.items() if at == path or at.startswith(f"{path}."))

    def matches(self, block: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Which of the messages (N, length) have this layout and the same strings: (N,)."""
        wanted = np.frombuffer(self.template, np.uint8)[self.fixed]
        same: NDArray[np.bool_] = (block[:, self.fixed] == wanted).all(axis=1)
        return same


def layout_of(definitions: Definitions, msgtype: str, raw: bytes, spare: bool = False) -> MessageLayout:
    """The layout of one message. Raises DamageError where it is no whole message of the type.

    ``spare``: ignore bytes after the message's end, as a buffer that is larger than the message has.
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
    return MessageLayout(raw, np.dtype(spec), walk.strings, np.array(walk.fixed, np.intp))


@dataclass
class _Walk:
    """The state of a walk through one message along its definition."""

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
        """The length that precedes a string or a sequence."""
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
