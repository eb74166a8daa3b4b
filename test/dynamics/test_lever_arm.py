"""Lever arms. Truth: finite differences of a point's place on a body that turns."""

import numpy as np
from scipy.spatial.transform import Rotation

from sysid_node.dynamics.lever_arm import (
    centripetal,
    specific_force_at,
    specific_force_from,
    velocity_at,
    velocity_from,
    without_centripetal,
)
from sysid_node.dynamics.vector import Vector

RATES, ARM, H = np.array([0.6, -0.8, 1.3]), np.array([0.5, -0.1, 0.2]), 1e-3
#: Body to earth at a time (s): turning about one axis ever faster, so that rates and acceleration are known.
ACCELERATION = 0.7 * RATES


def place(time: float) -> np.ndarray:
    """The point's place (m) from the centre of gravity, which is at rest in earth axes."""
    return Rotation.from_rotvec((time + 0.35 * time**2) * RATES).apply(ARM)


def test_velocity_of_a_point() -> None:
    moved = (place(H) - place(-H)) / (2.0 * H)
    at_rest = (0.0, 0.0, 0.0)
    np.testing.assert_allclose(velocity_at(at_rest, tuple(RATES), tuple(ARM)), moved, atol=1e-6)


def test_acceleration_of_a_point() -> None:
    felt = (place(H) - 2.0 * place(0.0) + place(-H)) / H**2
    at_rest = Vector(0.0, 0.0, 0.0)
    found = specific_force_at(at_rest, Vector(*RATES), Vector(*ACCELERATION), Vector(*ARM))
    np.testing.assert_allclose(found, felt, atol=1e-5)


def test_there_and_back_again() -> None:
    rates, acceleration, arm = Vector(*RATES), Vector(*ACCELERATION), Vector(*ARM)
    force, velocity = Vector(1.0, -2.0, -9.0), (20.0, 1.0, 2.0)
    np.testing.assert_allclose(without_centripetal(force, rates, arm), force.minus(centripetal(rates, arm)), rtol=1e-14)
    there = specific_force_at(force, rates, acceleration, arm)
    np.testing.assert_allclose(specific_force_from(there, rates, acceleration, arm), force, rtol=1e-14)
    np.testing.assert_allclose(velocity_from(velocity_at(velocity, rates, arm), rates, arm), velocity, rtol=1e-14)
