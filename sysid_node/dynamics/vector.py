"""Vectors of three components, each a number or an array."""

from __future__ import annotations

from typing import Any, NamedTuple

#: A real number, or an array of real numbers: float, NumPy's or JAX's array.
Real = Any

#: The library of elementary functions that suits the numbers: numpy, jax.numpy, or sysid_node.dynamics.scalar.
Namespace = Any


#: Three components as a plain tuple, which is what functions return that are called for every sample in flight: to make
#: a ``Vector`` takes longer than their arithmetic. Every function takes either.
Triple = tuple[Real, Real, Real]


class Vector(NamedTuple):
    """Three components along body axes (forward, right, down), or north, east, down."""

    x: Real
    y: Real
    z: Real

    def plus(self, other: Triple) -> Vector:
        """The sum."""
        a, b, c = self
        x, y, z = other
        return Vector(a + x, b + y, c + z)

    def minus(self, other: Triple) -> Vector:
        """The difference."""
        a, b, c = self
        x, y, z = other
        return Vector(a - x, b - y, c - z)

    def times(self, factor: Real) -> Vector:
        """The product with a number."""
        x, y, z = self
        return Vector(x * factor, y * factor, z * factor)

    def cross(self, other: Triple) -> Vector:
        """The vector product self x other."""
        a, b, c = self
        x, y, z = other
        return Vector(b * z - c * y, c * x - a * z, a * y - b * x)
