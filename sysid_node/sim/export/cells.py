"""Texts and numbers as every format takes them."""

from __future__ import annotations

import math

from sysid_node.errors import InputError


def plain(text: str) -> str:
    """The text in one line, without characters that are not printed: YAML and XML would take these for their own."""
    return " ".join("".join(character if character.isprintable() else " " for character in text).split())


def finite(value: float) -> float:
    """The value. Raises InputError where it is not a finite number, which no simulator can fly."""
    if not math.isfinite(value):
        raise InputError(
            f"a value of the model is {value}; it cannot be exported: correct the estimate or the aircraft file"
        )
    return float(value)
