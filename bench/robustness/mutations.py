"""Damage to files: bytes as a failing disk leaves them, and texts as people and programs mistype them."""

from __future__ import annotations

import random
import re
import struct
from collections.abc import Callable

#: What stands in place of a number: outside every range, of another kind, or nothing.
ODD_NUMBERS = (
    "nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "1e999", "0", "-0.0", "-1", "1e6", "1e-9", "1e18", "0x10",
    "1_000", "",
    "true", "null", "[]", "{}", "abc", "1,5", "9" * 400, "\u0663", "{value: 1, tolerance: -1}", "[1, 2, 3]",
)  # fmt: skip
_NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
_EXTREMES = (0, 1, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1)


def damage_bytes(content: bytes, rng: random.Random) -> bytes:
    """The content with one to four pieces of damage."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        rng.choice(_BYTES)(data, rng)
    return bytes(data)


def damage_text(text: str, rng: random.Random) -> bytes:
    """The text with one to three mistakes."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        text = rng.choice(_TEXTS)(text, rng)
    content = text.encode("utf-8", "surrogatepass")
    return damage_bytes(content, rng) if rng.random() < 0.1 else content


def _place(data: bytearray, rng: random.Random) -> int:
    """A place, often near the beginning or the end, where headers and indices are."""
    size = len(data)
    near = min(size, 400)
    at = rng.choice((rng.randrange(size or 1), rng.randrange(near or 1), size - 1 - rng.randrange(near or 1)))
    return max(at, 0)


def _flip(data: bytearray, rng: random.Random) -> None:
    if data:
        data[_place(data, rng)] ^= 1 << rng.randrange(8)


def _noise(data: bytearray, rng: random.Random) -> None:
    at, size = _place(data, rng), rng.choice((1, 4, 16, 300))
    data[at : at + size] = rng.randbytes(min(size, len(data) - at))


def _cut(data: bytearray, rng: random.Random) -> None:
    del data[_place(data, rng) :]


def _remove(data: bytearray, rng: random.Random) -> None:
    at = _place(data, rng)
    del data[at : at + rng.choice((1, 8, 500, 20_000))]


def _repeat(data: bytearray, rng: random.Random) -> None:
    at = _place(data, rng)
    data[at:at] = data[at : at + rng.choice((1, 8, 500, 20_000))]


def _zero(data: bytearray, rng: random.Random) -> None:
    at = _place(data, rng)
    size = min(rng.choice((4, 64, 4096)), len(data) - at)
    data[at : at + size] = bytes(size)


def _extreme(data: bytearray, rng: random.Random) -> None:
    at, size = _place(data, rng), rng.choice((2, 4, 8))
    if at + size <= len(data):
        data[at : at + size] = struct.pack("<Q", rng.choice(_EXTREMES))[:size]


def _number(text: str, rng: random.Random) -> str:
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    one = rng.choice(found)
    return text[: one.start()] + rng.choice(ODD_NUMBERS) + text[one.end() :]


def _line(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    at = rng.randrange(len(lines))
    other = rng.randrange(len(lines))
    kind = rng.choice(("drop", "twice", "swap", "empty", "indent", "cut"))
    if kind == "drop":
        del lines[at]
    elif kind == "twice":
        lines.insert(other, lines[at])
    elif kind == "swap":
        lines[at], lines[other] = lines[other], lines[at]
    elif kind == "empty":
        lines[at] = ""
    elif kind == "indent":
        lines[at] = "  " + lines[at]
    else:
        lines[at] = lines[at][: rng.randrange(len(lines[at]) + 1)]
    return "\n".join(lines)


def _mark(text: str, rng: random.Random) -> str:
    marks = [c for c in ",:;{}[]\"'\n.-" if c in text]
    if not marks:
        return text
    mark, new = rng.choice(marks), rng.choice((";", "\t", "", ",,", ": ", "\x00", "\ufeff", '"', "&a *a", "\r"))
    return text.replace(mark, new) if rng.random() < 0.3 else text.replace(mark, new, 1)


def _word(text: str, rng: random.Random) -> str:
    words = list(re.finditer(r"[A-Za-z_]{2,}", text))
    if not words:
        return text
    one = rng.choice(words)
    new = rng.choice((one[0][::-1], one[0].upper(), one[0] + "x", "x" * 5000, "\u00e4", "../../etc/passwd", one[0][1:]))
    return text[: one.start()] + new + text[one.end() :]


def _column(text: str, rng: random.Random) -> str:
    """One column of a table, everywhere: scaled, constant, empty, or gone."""
    rows = [line.split(",") for line in text.split("\n")]
    at, kind = rng.randrange(len(rows[0])), rng.choice(("scale", "constant", "empty", "gone"))
    factor = rng.choice((57.29578, 1e9, 1e-9, -1.0, 0.0, 1e300))
    for row in rows[1:]:
        if at >= len(row):
            continue
        if kind == "scale":
            row[at] = str(float(row[at]) * factor) if _NUMBER.fullmatch(row[at]) else row[at]
        else:
            row[at] = "1.0" if kind == "constant" else ""
    if kind == "gone":
        rows = [row[:at] + row[at + 1 :] for row in rows]
    return "\n".join(",".join(row) for row in rows)


_BYTES: tuple[Callable[[bytearray, random.Random], None], ...] = (
    _flip, _flip, _noise, _cut, _remove, _repeat, _zero, _extreme, _extreme,
)  # fmt: skip
_TEXTS = (_number, _number, _number, _line, _mark, _word, _column)
