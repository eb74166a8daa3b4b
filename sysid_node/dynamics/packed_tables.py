"""An aircraft's lookup tables in a few arrays, as few tables as will do.

Tables of one coefficient over the same variables are added up, and a table over one variable is added to one over two,
if there is one with this variable. All tables over a variable have the same points, so that a program looks for a
variable's interval once, and not once for each table. Neither changes what is interpolated, but by rounding: a function
that is linear between its points stays the same when points are put in between.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import LookupTable
from sysid_node.dynamics.vector import Real

Array = NDArray[np.float64]

#: The coefficient of a table and its one or two variables.
Place = tuple[str, tuple[str, ...]]
Places = tuple[Place, ...]

#: Points nearer than this share of a variable's range are one: tables that were written by a program have a point at
#: 0.15 and another at 0.15000000000000002.
_APART = 1e-9


class PackedTables(NamedTuple):
    """T tables over V variables in all.

    Between neighbouring points a table is ``c0 + a c1 + b c2 + a b c3``, where ``a`` and ``b`` are the shares of the
    first and the second variable's interval: a cell. A table over one variable has no ``c2`` and ``c3``.
    """

    points: Real  # (V, n) of each variable, in the order of ``variables_of``; the last one is repeated
    cells: Real  # (4, K) c0 to c3 of all tables, one row of cells after the other
    starts: Real  # (T,) where the cells of each table begin
    strides: Real  # (V, T) how many cells further the next interval of a variable is


def variables_of(places: Iterable[Place]) -> list[str]:
    """The variables of these tables, by name."""
    return sorted({variable for _, over in places for variable in over})


def coefficients_of(places: Iterable[Place]) -> list[str]:
    """The coefficients of these tables, in their order."""
    return list(dict.fromkeys(coefficient for coefficient, _ in places))


def places_of(tables: Sequence[LookupTable]) -> Places:
    """Coefficient and variables of each table that is left when the tables have been added up."""
    return tuple(_added_up(tables))


def pack(tables: Sequence[LookupTable]) -> tuple[Places, PackedTables]:
    """Coefficient and variables of each table that is left when the tables have been added up, and these tables."""
    points, sums = _points(tables), _added_up(tables)
    places, variables = tuple(sums), variables_of(sums)
    longest = max(map(len, points.values()))
    filled = [np.append(points[v], np.full(longest - len(points[v]), points[v][-1])) for v in variables]
    grids = [_cells(_sum(added, over, points)) for (_, over), added in sums.items()]
    starts = np.append(0, np.cumsum([grid[0].size for grid in grids])[:-1])
    strides = np.zeros((len(variables), len(places)), dtype=np.int32)
    for k, ((_, over), grid) in enumerate(zip(places, grids, strict=True)):
        strides[[variables.index(name) for name in over], k] = (grid.shape[2], 1)[-len(over) :]
    cells = np.concatenate([grid.reshape(4, -1) for grid in grids], axis=1)
    return places, PackedTables(np.array(filled), cells, starts.astype(np.int32), strides)


def _points(tables: Sequence[LookupTable]) -> dict[str, Array]:
    """The points of each variable, of all tables together."""
    found: dict[str, set[float]] = {}
    for table in tables:
        for name, points in zip(table.over, table.points, strict=True):
            found.setdefault(name, set()).update(points)
    return {name: _apart(np.array(sorted(points))) for name, points in found.items()}


def _apart(points: Array) -> Array:
    """Without those that are another one but for rounding."""
    kept = np.append(True, np.diff(points) > _APART * (points[-1] - points[0]))
    return np.asarray(points[kept])


def _added_up(tables: Sequence[LookupTable]) -> dict[Place, list[LookupTable]]:
    """The tables that are added up, by place."""
    places = [(table.coefficient, tuple(sorted(table.over))) for table in tables]
    pairs = dict.fromkeys(place for place in places if len(place[1]) == 2)
    found: dict[Place, list[LookupTable]] = {}
    for table, place in zip(tables, places, strict=True):
        hosts = (pair for pair in pairs if pair[0] == place[0] and set(place[1]) <= set(pair[1]))
        found.setdefault(next(hosts, place), []).append(table)
    return found


def _sum(tables: Sequence[LookupTable], over: tuple[str, ...], points: Mapping[str, Array]) -> Array:
    """The sum of the tables at the points of the variables ``over``."""
    total = np.zeros([points[name].size for name in over])
    for table in tables:
        values = np.array(table.values, dtype=float)
        for axis, (name, own) in enumerate(zip(table.over, table.points, strict=True)):
            values = _at(points[name], own, values, axis)
        if len(table.over) < len(over):
            values = np.expand_dims(values, 1 - over.index(table.over[0]))
        total += values if table.over != over[::-1] else values.T
    return total


def _cells(values: Array) -> Array:
    """(4, n - 1, m - 1) c0 to c3 of the values (n, m); of the values (n,) over one variable (4, 1, n - 1)."""
    if values.ndim == 1:
        nothing = np.zeros(values.size - 1)
        return np.stack([values[:-1], np.diff(values), nothing, nothing])[:, None, :]
    corner, first, second = values[:-1, :-1], np.diff(values, axis=0)[:, :-1], np.diff(values, axis=1)[:-1]
    return np.stack([corner, first, second, np.diff(np.diff(values, axis=0), axis=1)])


def _at(points: Array, own: Sequence[float], values: Array, axis: int) -> Array:
    """The values along an axis, where they are at the points ``own``, at other points."""
    return np.apply_along_axis(lambda line: np.interp(points, own, line), axis, values)
