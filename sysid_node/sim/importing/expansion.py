"""Coefficients of any model as derivatives and lookup tables of one or two variables.

The model is a function of its regressors. It is expanded about a point, the steady flight: the value there, what each
variable adds by itself, and what each pair of variables adds beyond that (cut-HDMR of second order: Rabitz & Alis
(1999), "General foundations of high-dimensional model representations", J. Math. Chem. 25). A part that is linear in
one variable is a derivative; everything else is a table. What three variables only add together is left out, and
``largest_error`` measures it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import LookupTable
from sysid_node.aircraft.names import COEFFICIENTS

Array = NDArray[np.float64]

#: Columns (N,) of variables -> coefficients (N, 6), in the order of ``COEFFICIENTS``.
Function = Callable[[Mapping[str, Array]], Array]


#: Variables that have no derivative in an aircraft file.
_NO_DERIVATIVE = ("V", "throttle")
#: Variables at whose every value a program may take long to settle; the last is changed least often.
_SLOW = ("throttle", "V")


@dataclass(frozen=True)
class TableAxis:
    """One variable: its nodes, ascending, its value in the steady flight (one of the nodes) and a small step."""

    nodes: Array
    centre: float
    step: float

    @classmethod
    def of(cls, nodes: Array | list[float], centre: float, step: float) -> TableAxis:
        """The axis with the centre among its nodes; nodes closer than a hundredth of the step are one."""
        every = np.unique(np.append(np.asarray(nodes, float), centre))
        keep = np.append(True, np.diff(every) > 0.01 * step)
        kept = every[keep]
        kept[np.argmin(np.abs(kept - centre))] = centre
        return cls(kept, centre, step)

    @property
    def middle(self) -> int:
        """The index of the steady flight's node."""
        return int(np.argmin(np.abs(self.nodes - self.centre)))


@dataclass(frozen=True)
class Expansion:
    """Derivatives by name and tables that together are the function at every node of every pair of variables."""

    derivatives: dict[str, float]
    tables: tuple[LookupTable, ...]


def expand(function: Function, axes: Mapping[str, TableAxis], tolerance: Array) -> Expansion:
    """The function about the centre of its axes.

    ``tolerance`` (6,) is the change of each coefficient that is left out. The variables ``V`` (m/s; its derivative
    would be per reference airspeed) and ``throttle`` have none: what they do by themselves is a table.
    """
    centre = {name: axis.centre for name, axis in axes.items()}
    f0 = function({name: np.array([value]) for name, value in centre.items()})[0]
    alone = {name: _along(function, centre, {name: axis.nodes}) - f0 for name, axis in axes.items()}
    slopes = {name: _slope(function, centre, name, axis) for name, axis in axes.items() if name not in _NO_DERIVATIVE}
    derivatives: dict[str, float] = {}
    tables: list[LookupTable] = []
    for k, coefficient in enumerate(COEFFICIENTS):
        offset = float(f0[k])
        for name, axis in axes.items():
            slope = float(slopes[name][k]) if name in slopes else 0.0
            if abs(slope) * np.ptp(axis.nodes) > tolerance[k]:
                derivatives[f"{coefficient}_{name}"] = slope
                offset -= slope * axis.centre
            else:
                slope = 0.0
            rest = alone[name][:, k] - slope * (axis.nodes - axis.centre)
            if np.abs(rest).max() > tolerance[k]:
                keep = thinned(axis.nodes, rest[:, None], tolerance[k], axis.middle)
                tables.append(LookupTable(coefficient, (name,), (_numbers(axis.nodes[keep]),), _numbers(rest[keep])))
        derivatives[f"{coefficient}_0"] = offset
    for first, second in combinations(axes, 2):
        tables += _pair(function, axes, centre, (first, second), alone, f0, tolerance)
    return Expansion({name: derivatives[name] for name in sorted(derivatives, key=_order)}, tuple(tables))


def evaluate(expansion: Expansion, points: Mapping[str, Array]) -> Array:
    """Coefficients (N, 6) of the expansion; tables are linear between points and held beyond their ends."""
    size = len(next(iter(points.values())))
    result = np.zeros((size, len(COEFFICIENTS)))
    for name, value in expansion.derivatives.items():
        coefficient, _, regressor = name.partition("_")
        column = np.ones(size) if regressor == "0" else points[regressor]
        result[:, COEFFICIENTS.index(coefficient)] += value * column
    for table in expansion.tables:
        result[:, COEFFICIENTS.index(table.coefficient)] += look_up(table, points)
    return result


def look_up(table: LookupTable, points: Mapping[str, Array]) -> Array:
    """A table's values (N,)."""
    values = np.asarray(table.values)
    if len(table.over) == 1:
        return np.asarray(np.interp(points[table.over[0]], table.points[0], values))
    i, a = _place(np.asarray(table.points[0]), points[table.over[0]])
    j, b = _place(np.asarray(table.points[1]), points[table.over[1]])
    low = (1.0 - b) * values[i, j] + b * values[i, j + 1]
    return np.asarray((1.0 - a) * low + a * ((1.0 - b) * values[i + 1, j] + b * values[i + 1, j + 1]))


def largest_error(
    function: Function, expansion: Expansion, axes: Mapping[str, TableAxis], share: float, count: int, seed: int = 0
) -> tuple[Array, Array]:
    """Largest error and range (6,) over random states in which all variables differ from the steady flight at once.

    ``share`` is the share of each axis, on both sides of its centre, that the states fill.
    """
    random = np.random.default_rng(seed)
    points = {
        name: axis.centre + share * (random.uniform(axis.nodes[0], axis.nodes[-1], count) - axis.centre)
        for name, axis in axes.items()
    }
    if "V" in points:  # the program that is asked may take long to settle at another airspeed
        points["V"] = np.sort(points["V"])
    found = function(points)
    return np.abs(found - evaluate(expansion, points)).max(axis=0), np.ptp(found, axis=0)


def thinned(nodes: Array, values: Array, tolerance: float, middle: int | None = None) -> NDArray[np.intp]:
    """Nodes to keep so that linear interpolation is right within the tolerance at all (Douglas & Peucker, 1973).

    ``middle`` is the index of a node that is kept, for there the tables are to be exact: it is the steady flight.
    Where the two ends alone are right, nothing but they is needed.
    """
    last = len(nodes) - 1
    if middle is None or not 0 < middle < last or _straight(nodes, values, 1e-3 * tolerance):
        open_parts, keep = [(0, last)], {0, last}
    else:
        open_parts, keep = [(0, middle), (middle, last)], {0, middle, last}
    while open_parts:
        low, high = open_parts.pop()
        if high - low < 2:
            continue
        inner = slice(low + 1, high)
        share = ((nodes[inner] - nodes[low]) / (nodes[high] - nodes[low]))[:, None]
        miss = np.abs(values[inner] - (1.0 - share) * values[low] - share * values[high]).max(axis=1)
        worst = int(np.argmax(miss))
        if miss[worst] > tolerance:
            between = low + 1 + worst
            keep.add(between)
            open_parts += [(low, between), (between, high)]
    return np.array(sorted(keep))


def _straight(nodes: Array, values: Array, tolerance: float) -> bool:
    """Whether the ends alone give every value."""
    share = ((nodes - nodes[0]) / (nodes[-1] - nodes[0]))[:, None]
    return bool(np.abs(values - (1.0 - share) * values[0] - share * values[-1]).max() <= tolerance)


def _pair(
    function: Function,
    axes: Mapping[str, TableAxis],
    centre: Mapping[str, float],
    names: tuple[str, str],
    alone: Mapping[str, Array],
    f0: Array,
    tolerance: Array,
) -> list[LookupTable]:
    """Tables of what two variables add together beyond what each adds by itself."""
    first, second = (axes[name].nodes for name in names)
    grid = _along(function, centre, dict(zip(names, (first, second), strict=True)))
    joint = grid - alone[names[0]][:, None, :] - alone[names[1]][None, :, :] - f0
    tables = []
    for k, coefficient in enumerate(COEFFICIENTS):
        part = joint[:, :, k]
        if np.abs(part).max() <= tolerance[k]:
            continue
        rows = thinned(first, part, 0.5 * tolerance[k], axes[names[0]].middle)
        columns = thinned(second, part.T, 0.5 * tolerance[k], axes[names[1]].middle)
        values = tuple(_numbers(row) for row in part[np.ix_(rows, columns)])
        tables.append(LookupTable(coefficient, names, (_numbers(first[rows]), _numbers(second[columns])), values))
    return tables


def _along(function: Function, centre: Mapping[str, float], moving: Mapping[str, Array]) -> Array:
    """The function (..., 6) on the grid of some variables, the others as in the steady flight."""
    grids = np.meshgrid(*moving.values(), indexing="ij")
    shape = grids[0].shape
    points = {name: np.full(grids[0].size, value) for name, value in centre.items()}
    points |= {name: grid.ravel() for name, grid in zip(moving, grids, strict=True)}
    slow = [points[name] for name in _SLOW if name in points]
    order = np.lexsort(slow) if slow else np.arange(grids[0].size)
    result = np.empty((grids[0].size, len(COEFFICIENTS)))
    result[order] = function({name: column[order] for name, column in points.items()})
    return result.reshape(*shape, len(COEFFICIENTS))


def _slope(function: Function, centre: Mapping[str, float], name: str, axis: TableAxis) -> Array:
    """The derivative (6,) at the centre by central differences."""
    both = _along(function, centre, {name: axis.centre + axis.step * np.array([-1.0, 1.0])})
    return np.asarray((both[1] - both[0]) / (2.0 * axis.step))


def _place(nodes: Array, x: Array) -> tuple[NDArray[np.intp], Array]:
    """The interval of each x and its share there, held beyond the ends."""
    i = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 2)
    return i, np.clip((x - nodes[i]) / (nodes[i + 1] - nodes[i]), 0.0, 1.0)


def _numbers(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _order(name: str) -> tuple[int, int]:
    coefficient, _, regressor = name.partition("_")
    return COEFFICIENTS.index(coefficient), regressor != "0"
