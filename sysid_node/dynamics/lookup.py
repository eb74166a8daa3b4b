"""Lookup tables: linear between their points, held beyond the ends. The same for NumPy and JAX, scalars and series."""

from __future__ import annotations

from collections.abc import Sequence

from sysid_node.dynamics.vector import Namespace, Real


def interpolate(points: Sequence[Real], values: Real, at: Sequence[Real], xp: Namespace) -> Real:
    """The table's value at one or two variables ``at``, each (...).

    ``points`` are the increasing points (n,) and (m,) of each variable, ``values`` (n,) or (n, m). The function is
    bilinear between the points. It is a sum over the intervals, each with the share of it that has been passed, so
    that it has no branch and its derivatives are exact.
    """
    first = passed(points[0], at[0], xp)
    if len(points) == 1:
        return values[0] + (first * (values[1:] - values[:-1])).sum(-1)
    rows = values[0] + (first[..., None] * (values[1:] - values[:-1])).sum(-2)
    second = passed(points[1], at[1], xp)
    return rows[..., 0] + (second * (rows[..., 1:] - rows[..., :-1])).sum(-1)


def passed(points: Real, x: Real, xp: Namespace) -> Real:
    """The share (..., n - 1), 0 to 1, of each interval between points (n,) that lies below x (...)."""
    return xp.clip((xp.asarray(x)[..., None] - points[:-1]) / (points[1:] - points[:-1]), 0.0, 1.0)
