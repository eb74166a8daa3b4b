"""The block ``tables`` of an aircraft file: lookup tables that are added to the coefficients."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

from sysid_node.aircraft.document import DocumentEntry
from sysid_node.aircraft.model import Control, LookupTable, Throttle
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.suggestion import did_you_mean

#: What a table may be over besides the controls' symbols, with units.
TABLE_VARIABLES = {
    "alpha": "rad",
    "beta": "rad",
    "V": "m/s",
    "Mach": "1",
    "p": "p b / 2V",
    "q": "q cbar / 2V",
    "r": "r b / 2V",
}


def read_tables(
    entry: DocumentEntry | None, controls: Mapping[str, Control], throttle: Throttle | None
) -> tuple[LookupTable, ...]:
    """The tables in the file's order; over the throttle where it is a share of a largest thrust. Raises InputError."""
    if entry is None:
        return ()
    variables = {**TABLE_VARIABLES, **{control.symbol: "rad" for control in controls.values()}}
    if throttle is not None and throttle.max_thrust is not None:
        variables["throttle"] = "0..1"
    example = "a list of tables, e.g. - {coefficient: CL, over: [alpha], alpha: [0.0, 0.2], values: [0.0, -0.1]}"
    return tuple(_table(item, variables) for item in entry.items(example))


def _table(entry: DocumentEntry, variables: Mapping[str, str]) -> LookupTable:
    meanings = {
        "coefficient": f"one of {', '.join(COEFFICIENTS)}",
        "over": "the variables that it depends on, e.g. [alpha]",
        "values": "a number for each point",
    }
    raw = entry.mapping(f"a table with {', '.join(meanings)} and the points of each variable")
    over = _over(raw["over"], variables) if "over" in raw else ()
    fields = entry.fields({**meanings, **{name: f"its points ({variables[name]})" for name in over}})
    coefficient = fields["coefficient"].text(meanings["coefficient"])
    if coefficient not in COEFFICIENTS:
        raise fields["coefficient"].error(
            f"got {coefficient!r}, expected {meanings['coefficient']}{did_you_mean(coefficient, COEFFICIENTS)}"
        )
    points = tuple(_points(fields[name], name, variables[name]) for name in over)
    return LookupTable(coefficient, over, points, _values(fields["values"], over, points))


def _over(entry: DocumentEntry, variables: Mapping[str, str]) -> tuple[str, ...]:
    expected = f"a list of one or two of {', '.join(variables)}"
    items = entry.items(expected)
    names = tuple(item.text("a variable's name") for item in items)
    for item, name in zip(items, names, strict=True):
        if name not in variables:
            raise item.error(f"got {name!r}, expected one of {', '.join(variables)}{did_you_mean(name, variables)}")
    if len(names) not in (1, 2) or len(set(names)) != len(names):
        raise entry.error(f"got {', '.join(names) or 'nothing'}; expected {expected}, each once")
    return names


def _points(entry: DocumentEntry, name: str, unit: str) -> tuple[float, ...]:
    points = tuple(item.number(f"a number ({unit})") for item in entry.items(f"the points of {name} ({unit})"))
    if len(points) < 2:
        raise entry.error(f"got {len(points)} points, expected at least two")
    for before, after in pairwise(points):
        if after <= before:
            raise entry.error(f"got {after:g} after {before:g}; the points must increase")
    if unit == "rad" and max(abs(points[0]), abs(points[-1])) > math.pi:
        raise entry.error(f"got points from {points[0]:g} to {points[-1]:g} rad; is it in degrees?")
    return points


def _values(
    entry: DocumentEntry, over: Sequence[str], points: Sequence[Sequence[float]]
) -> tuple[float, ...] | tuple[tuple[float, ...], ...]:
    if len(over) == 1:
        return _row(entry, over[0], len(points[0]))
    rows = entry.items(f"a row for each point of {over[0]}")
    if len(rows) != len(points[0]):
        raise entry.error(f"got {len(rows)} rows, expected {len(points[0])}, one for each point of {over[0]}")
    return tuple(_row(row, over[1], len(points[1])) for row in rows)


def _row(entry: DocumentEntry, name: str, count: int) -> tuple[float, ...]:
    items = entry.items(f"a list of {count} numbers, one for each point of {name}")
    if len(items) != count:
        raise entry.error(f"got {len(items)} values, expected {count}, one for each point of {name}")
    return tuple(item.number("a number") for item in items)
