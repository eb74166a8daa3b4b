"""Attitude. Truth: SciPy's rotations, and finite differences of them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sysid_node.dynamics.attitude import (
    down_in_body,
    down_of_euler,
    euler_angles,
    euler_rates,
    quaternion,
    quaternion_rate,
    to_earth,
)
from sysid_node.dynamics.vector import Vector

ANGLES = [(0.3, 0.5, -2.0), (-2.8, -1.2, 3.0), (0.0, 0.0, 0.0)]


def rotation(angles: tuple[float, float, float]) -> Rotation:
    """Body to earth."""
    return Rotation.from_euler("ZYX", angles[::-1])


@pytest.mark.parametrize("angles", ANGLES)
def test_quaternion_turns_body_into_earth(angles: tuple[float, float, float]) -> None:
    attitude, vector = quaternion(angles, np), (0.3, -2.0, 1.5)
    np.testing.assert_allclose(to_earth(attitude, Vector(*vector)), rotation(angles).apply(vector), atol=1e-14)
    down = rotation(angles).inv().apply((0.0, 0.0, 1.0))
    np.testing.assert_allclose(down_in_body(attitude), down, atol=1e-14)
    np.testing.assert_allclose(down_of_euler(*angles[:2], np), down, atol=1e-14)
    np.testing.assert_allclose(euler_angles(attitude, np), angles, atol=1e-14)


def test_a_drift_of_the_norm_turns_nothing() -> None:
    attitude = quaternion(ANGLES[0], np)
    longer = tuple(1.1 * part for part in attitude)
    np.testing.assert_allclose(euler_angles(longer, np), ANGLES[0], atol=1e-14)
    np.testing.assert_allclose(to_earth(longer, Vector(1.0, 2.0, 3.0)), to_earth(attitude, Vector(1.0, 2.0, 3.0)))


@pytest.mark.parametrize("angles", ANGLES)
def test_rates_are_those_of_a_body_that_turns(angles: tuple[float, float, float]) -> None:
    rates, h = np.array([0.7, -0.4, 1.1]), 1e-5
    before, after = (rotation(angles) * Rotation.from_rotvec(sign * h * rates) for sign in (-1.0, 1.0))
    euler = (after.as_euler("ZYX")[::-1] - before.as_euler("ZYX")[::-1]) / (2.0 * h)
    np.testing.assert_allclose(euler_rates(*angles[:2], Vector(*rates), np), euler, rtol=1e-8)
    attitude = np.array(quaternion(angles, np))
    x, y, z, w = after.as_quat() * np.sign(after.as_quat() @ attitude[[1, 2, 3, 0]])
    moved = attitude + h * np.array(quaternion_rate(tuple(attitude), Vector(*rates)))
    np.testing.assert_allclose(moved, (w, x, y, z), atol=1e-9)
