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


def interpolate(tables: PackedTables, first: Real, second: Real, xp: Namespace) -> Real:
    """The tables' values (..., T) at their first and second variables (..., T); bilinear between the points."""
    i, a = _interval(tables.rows, first, xp)
    j, b = _interval(tables.columns, second, xp)
    count, n, m = tables.values.shape
    flat, corner = tables.values.reshape(-1), (np.arange(count) * n + i) * m + j
    low = (1.0 - b) * flat[corner] + b * flat[corner + 1]
    high = (1.0 - b) * flat[corner + m] + b * flat[corner + m + 1]
    return (1.0 - a) * low + a * high


def _interval(points: Real, x: Real, xp: Namespace) -> tuple[Real, Real]:
    """The interval (..., T) of each table's points (T, n) in which x (..., T) lies, and the share of it, 0 to 1."""
    index = (points[:, 1:-1] <= x[..., None]).sum(-1)
    table = np.arange(points.shape[0])
    low, high = points[table, index], points[table, index + 1]
    return index, xp.clip((x - low) / (high - low), 0.0, 1.0)


def _two_dimensional(points: Sequence[ArrayLike], values: ArrayLike) -> tuple[Any, Any, Any]:
    value = np.asarray(values, dtype=float)
    axes = [np.asarray(axis, dtype=float) for axis in points]
    if len(axes) == 1:
        return axes[0], np.array([0.0, 1.0]), np.column_stack([value, value])
    return axes[0], axes[1], value


def _lengthened(points: Any, size: int) -> Any:
    """The points with more at their end, further and further on."""
    return np.append(points, points[-1] + np.arange(1, size - len(points) + 1))
