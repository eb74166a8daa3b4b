"""Lookup tables: linear between their points, held beyond the ends. The same for NumPy and JAX, scalars and series.

All tables of an aircraft are looked up at once. An aircraft that was read from another simulator has a hundred of them,
and a compiled program that looked up one after the other would take minutes to compile.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sysid_node.dynamics.vector import Namespace, Real


class PackedTables(NamedTuple):
    """T tables of one or two variables as arrays of one size: each is padded, and a single variable has a second one.

    Points beyond a table's last have its last value, so that they are never told from holding it.
    """

    rows: Real  # (T, n) points of the first variable
    columns: Real  # (T, m) points of the second
    values: Real  # (T, n, m)


def pack(tables: Sequence[tuple[Sequence[ArrayLike], ArrayLike]]) -> PackedTables:
    """The tables, each given by the increasing points of its one or two variables and its values, in one."""
    full = [_two_dimensional(points, values) for points, values in tables]
    n, m = (max(len(item[axis]) for item in full) for axis in (0, 1))
    rows, columns = ([_lengthened(item[axis], size) for item in full] for axis, size in ((0, n), (1, m)))
    values = [np.pad(v, ((0, n - v.shape[0]), (0, m - v.shape[1])), "edge") for _, _, v in full]
    return PackedTables(np.array(rows), np.array(columns), np.array(values))


class Interpolation(NamedTuple):
    """Values (..., T) of T tables, and their slopes (..., T) with the first and with the second variable.

    The slopes are those of the interval in which a variable lies, and zero beyond the ends.
    """

    values: Real
    by_first: Real
    by_second: Real


def interpolate(tables: PackedTables, first: Real, second: Real, xp: Namespace) -> Real:
    """The tables' values (..., T) at their first and second variables (..., T); bilinear between the points."""
    return interpolate_with_slopes(tables, first, second, xp).values


def interpolate_with_slopes(tables: PackedTables, first: Real, second: Real, xp: Namespace) -> Interpolation:
    """The same with the slopes."""
    rows, columns = _interval(tables.rows, first, xp), _interval(tables.columns, second, xp)
    count, n, m = tables.values.shape
    flat, corner = tables.values.reshape(-1), (np.arange(count) * n + rows.index) * m + columns.index
    (near_low, near_high), (far_low, far_high) = ((flat[k], flat[k + 1]) for k in (corner, corner + m))
    a, b = rows.share, columns.share
    low, high = (1.0 - b) * near_low + b * near_high, (1.0 - b) * far_low + b * far_high
    across = (1.0 - a) * (near_high - near_low) + a * (far_high - far_low)
    return Interpolation((1.0 - a) * low + a * high, (high - low) * rows.slope, across * columns.slope)


class _Interval(NamedTuple):
    """Where a variable lies in each table's points."""

    index: Real  # (..., T) of the point before it
    share: Real  # (..., T) of the interval that lies before it, 0 to 1
    slope: Real  # (..., T) of the share


def _interval(points: Real, x: Real, xp: Namespace) -> _Interval:
    """Where x (..., T) lies in points (T, n).

    By bisection: a compiled program would compare x with all points anew wherever the interval is used.
    """
    table, last = np.arange(points.shape[0]), points.shape[1] - 2
    index, step = xp.zeros(x.shape, dtype=int), 1 << last.bit_length()
    while step := step // 2:
        ahead = xp.minimum(index + step, last)
        index = xp.where(points[table, ahead] <= x, ahead, index)
    low, high = points[table, index], points[table, index + 1]
    share = (x - low) / (high - low)
    return _Interval(index, xp.clip(share, 0.0, 1.0), ((x >= low) & (x <= high)) / (high - low))


def _two_dimensional(points: Sequence[ArrayLike], values: ArrayLike) -> tuple[Any, Any, Any]:
    value = np.asarray(values, dtype=float)
    axes = [np.asarray(axis, dtype=float) for axis in points]
    if len(axes) == 1:
        return axes[0], np.array([0.0, 1.0]), np.column_stack([value, value])
    return axes[0], axes[1], value


def _lengthened(points: Any, size: int) -> Any:
    """The points with more at their end, further and further on."""
    return np.append(points, points[-1] + np.arange(1, size - len(points) + 1))
