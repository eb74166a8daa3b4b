"""Vectors of three components, each a number or an array."""

from __future__ import annotations

from typing import Any, NamedTuple

#: A real number, or an array of real numbers: float, NumPy's or JAX's array.
Real = Any

#: The library of elementary functions that suits the numbers: numpy, jax.numpy, or sysid_node.dynamics.scalar.
Namespace = Any


class Vector(NamedTuple):
    """Three components along body axes (forward, right, down), or north, east, down."""

    x: Real
    y: Real
    z: Real

    def plus(self, other: Vector) -> Vector:
        """The sum."""
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def minus(self, other: Vector) -> Vector:
        """The difference."""
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def times(self, factor: Real) -> Vector:
        """The product with a number."""
        return Vector(self.x * factor, self.y * factor, self.z * factor)

    def cross(self, other: Vector) -> Vector:
        """The vector product self x other."""
        return Vector(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
