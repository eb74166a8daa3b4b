"""Lookup tables: linear between their points, held beyond the ends. The same for NumPy and JAX, numbers and series.

All tables of an aircraft are looked up at once. An aircraft that was read from another simulator has a hundred of them,
and a compiled program that looked up one after the other would take minutes to compile.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.dynamics.packed_tables import PackedTables, Places, coefficients_of, variables_of
from sysid_node.dynamics.vector import Namespace, Real


class Interpolation(NamedTuple):
    """What the tables add to each of C coefficients, and how that changes with each of V variables.

    The slopes are those of the interval in which a variable lies, and zero beyond the ends.
    """

    values: Real  # (..., C)
    slopes: Real  # (..., C, V)


def interpolate(places: Places, tables: PackedTables, at: Real, xp: Namespace) -> Real:
    """The sums (..., C) of each coefficient's tables at the variables ``at`` (..., V); bilinear between the points.

    ``places`` belong to ``tables``; C and V are in the order of ``coefficients_of`` and ``variables_of``.
    """
    incidence = _incidence(places)
    found = _interpolate(incidence, tables, _intervals(tables.points, at, xp), xp)
    return found.values @ incidence.coefficients


def interpolate_with_slopes(places: Places, tables: PackedTables, at: Real, xp: Namespace) -> Interpolation:
    """The same with the slopes."""
    incidence, intervals = _incidence(places), _intervals(tables.points, at, xp)
    found = _interpolate(incidence, tables, intervals, xp)
    own = incidence.coefficients
    by_share = found.by_first @ _by_both(own, incidence.first) + found.by_second @ _by_both(own, incidence.second)
    slopes = by_share.reshape(*at.shape[:-1], -1, at.shape[-1]) * intervals.slope[..., None, :]
    return Interpolation(found.values @ own, slopes)


class _Intervals(NamedTuple):
    """Where each variable lies between its points."""

    index: Real  # (..., V) of the point before it
    share: Real  # (..., V) of the interval that lies before it, 0 to 1
    slope: Real  # (..., V) of the share


def _intervals(points: Real, x: Real, xp: Namespace) -> _Intervals:
    """Where x (..., V) lies in points (V, n).

    By bisection: a compiled program would compare x with all points anew wherever the interval is used.
    """
    count, n = points.shape
    row, end, last = n * np.arange(count, dtype=np.int32), points[:, -1], n - 2

    def point(index: Real) -> Real:
        return xp.take(points.reshape(-1), row + index, mode="clip")

    index, step = xp.zeros(x.shape, dtype=np.int32), 1 << last.bit_length()
    while step := step // 2:
        ahead = xp.minimum(index + step, last)
        reached = point(ahead)
        index = xp.where((reached <= x) & (reached < end), ahead, index)
    low, high = point(index), point(index + 1)
    share = (x - low) / (high - low)
    return _Intervals(index, xp.clip(share, 0.0, 1.0), ((x >= low) & (x <= high)) / (high - low))


class _OfTables(NamedTuple):
    """Of each of T tables (..., T)."""

    values: Real
    by_first: Real  # slope with the share of the first variable's interval
    by_second: Real  # with that of the second


def _interpolate(incidence: _Incidence, tables: PackedTables, intervals: _Intervals, xp: Namespace) -> _OfTables:
    cell, size = tables.starts + intervals.index @ tables.strides, tables.cells.shape[1]
    c0, c1, c2, c3 = (xp.take(tables.cells.reshape(-1), cell + k * size, mode="clip") for k in range(4))
    a, b = intervals.share @ incidence.first, intervals.share @ incidence.second
    by_first, by_second = c1 + b * c3, c2 + a * c3
    return _OfTables(c0 + a * c1 + b * by_second, by_first, by_second)


class _Incidence(NamedTuple):
    """Ones where a table is of a coefficient or over a variable, else zeros.

    To pick columns by such a matrix is a third of the work of picking them by their numbers, in a compiled program.
    """

    coefficients: NDArray[Any]  # (T, C)
    first: NDArray[Any]  # (V, T) each table's first variable
    second: NDArray[Any]  # (V, T) its second


def _incidence(places: Places) -> _Incidence:
    variables, coefficients = variables_of(places), coefficients_of(places)
    own = [[float(coefficient == name) for name in coefficients] for coefficient, _ in places]
    first, second = ([[float(over[k : k + 1] == (v,)) for _, over in places] for v in variables] for k in (0, 1))
    return _Incidence(np.array(own), np.array(first), np.array(second))


def _by_both(coefficients: NDArray[Any], variables: NDArray[Any]) -> NDArray[Any]:
    """(T, C V) ones where a table is of a coefficient and over a variable."""
    pairs: NDArray[Any] = coefficients[:, :, None] * variables.T[:, None, :]
    return pairs.reshape(len(coefficients), -1)
