"""Numbers that may stand alone or as ``{value, tolerance}``."""

from __future__ import annotations

import math
from collections.abc import Callable

from sysid_node.aircraft.document import DocumentEntry
from sysid_node.aircraft.model import UncertainValue

#: Reads and checks the plain number of an entry.
ReadNumber = Callable[[DocumentEntry], float]


class Quantities:
    """Reads numbers and collects the tolerances that the file states with them, by dotted key."""

    def __init__(self) -> None:
        self.stated: dict[str, float] = {}

    def read(self, entry: DocumentEntry, key: str, number: ReadNumber) -> float:
        """The number of an entry; its tolerance, if there is one, is stored under ``key``."""
        found = uncertain(entry, number)
        if found.tolerance is not None:
            self.stated[key] = found.tolerance
        return found.value


def uncertain(entry: DocumentEntry, number: ReadNumber) -> UncertainValue:
    """The value of an entry, with its tolerance where it is given. Raises InputError."""
    if not entry.is_mapping:
        return UncertainValue(number(entry))
    fields = entry.fields({"value": "the value, e.g. {value: 1.0, tolerance: 0.1}"}, optional=("tolerance",))
    value = number(fields["value"])
    if "tolerance" not in fields:
        return UncertainValue(value)
    return UncertainValue(value, fields["tolerance"].number("1 sigma in the value's unit, not negative", _not_negative))


def _not_negative(x: float) -> bool:
    return x >= 0


#: Least and greatest positive number, in SI units, that anything about an aircraft can have.
_LEAST, GREATEST = 1e-9, 1e9


def positive(unit: str, least: float = _LEAST, greatest: float = GREATEST) -> ReadNumber:
    """A reader of positive numbers within a range."""
    expected = f"a positive number ({unit}, {least:g} to {greatest:g})".replace("e-0", "e-").replace("e+0", "e")
    return lambda entry: entry.number(expected, lambda x: least <= x <= greatest)


def any_number(unit: str) -> ReadNumber:
    """A reader of finite numbers."""
    return lambda entry: entry.number(f"a number ({unit})")


def angle(entry: DocumentEntry) -> float:
    """An angle in rad between -pi/2 and pi/2."""
    return entry.number("an angle in rad, at most pi/2 (is it in degrees?)", lambda x: abs(x) <= math.pi / 2)
