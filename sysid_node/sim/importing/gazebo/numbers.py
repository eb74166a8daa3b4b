"""Numbers in the elements of an SDF."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError

Array = NDArray[np.float64]


def number(element: Element, file: str) -> float:
    """The element's text as a number. Raises InputError."""
    return numbers(element, file, 1)[0]


def numbers(element: Element, file: str, count: int) -> list[float]:
    """The element's text as so many finite numbers. Raises InputError."""
    try:
        values = [float(text) for text in (element.text or "").split()]
    except ValueError:
        values = []
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise InputError(f"{file}: <{element.tag}>: got {(element.text or '').strip()!r}, expected {count} numbers")
    return values


def number_in(parent: Element, tag: str, default: float, file: str) -> float:
    """A number of a child element, or the default where it is absent."""
    element = parent.find(tag)
    return default if element is None else number(element, file)


def positive_in(parent: Element, tag: str, default: float, file: str) -> float:
    """The same of a plugin, above zero. Raises InputError."""
    value = number_in(parent, tag, default, file)
    if not value > 0.0:
        what = (parent.get("name") or parent.tag).rpartition("::")[2]
        article = "an" if what[:1] in "AEIOU" else "a"
        raise InputError(f"{file}: {tag} of {article} {what} plugin is {value:g}; it must be above zero")
    return value


def vector_in(parent: Element, tag: str, default: tuple[float, float, float], file: str) -> Array:
    """Three numbers of a child element, or the default where it is absent."""
    element = parent.find(tag)
    return np.array(default if element is None else numbers(element, file, 3), dtype=float)
