"""What an export gives."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Exported:
    """The model's text, and what of the aircraft its format does not hold, a line each."""

    text: str
    left_out: tuple[str, ...] = ()
    held: frozenset[str] = frozenset()  # effects that the format can hold, at least in part
