"""Axes: half turns, and Euler angles against SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sysid_node.flight.frames import euler_from_quaternion, quaternion_from_euler, tilt_from_quaternion, turn_vectors

#: Axes of FRD in FLU, and of NED in ENU, one a column (REP-103).
FRD_IN_FLU = np.diag([1.0, -1.0, -1.0])
NED_IN_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


@pytest.fixture
def angles() -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.column_stack([rng.uniform(-3.1, 3.1, 50), rng.uniform(-1.5, 1.5, 50), rng.uniform(-3.1, 3.1, 50)])


def test_flu_vectors_turn_about_x():
    assert turn_vectors(np.array([[1.0, 2.0, 3.0]]), "flu").tolist() == [[1.0, -2.0, -3.0]]
    assert turn_vectors(np.array([[1.0, 2.0, 3.0]]), "frd").tolist() == [[1.0, 2.0, 3.0]]


def test_quaternions_are_those_of_the_rotation_matrices(angles):
    ned_from_frd = Rotation.from_euler("ZYX", angles[:, ::-1]).as_matrix()
    enu_from_flu = NED_IN_ENU @ ned_from_frd @ FRD_IN_FLU.T
    for frame, matrix in (("frd", ned_from_frd), ("flu", enu_from_flu)):
        ours = Rotation.from_quat(quaternion_from_euler(angles, frame)).as_matrix()
        np.testing.assert_allclose(ours, matrix, atol=1e-12)


@pytest.mark.parametrize("frame", ["flu", "frd"])
def test_euler_angles_return(angles, frame):
    np.testing.assert_allclose(euler_from_quaternion(quaternion_from_euler(angles, frame), frame), angles, atol=1e-9)


def test_heading_north_is_facing_along_enu_y():
    # REP-103: yaw zero faces east; facing north is a quarter turn to the left
    north = np.array([[0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4)]])
    np.testing.assert_allclose(euler_from_quaternion(north, "flu"), [[0.0, 0.0, 0.0]], atol=1e-12)


def test_no_rotation_no_attitude():
    assert np.isnan(euler_from_quaternion(np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.1]]), "flu")).all()


@pytest.mark.parametrize("frame", ["flu", "frd"])
def test_one_tilt_is_that_of_many_attitudes(angles, frame):
    quaternions = 1.005 * quaternion_from_euler(angles, frame)
    one_by_one = [tilt_from_quaternion(tuple(row), frame) for row in quaternions.tolist()]
    np.testing.assert_allclose(one_by_one, euler_from_quaternion(quaternions, frame)[:, :2], atol=1e-12)
    for strange in ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.1), (np.nan, 0.0, 0.0, 1.0), (np.inf, 0.0, 0.0, 1.0)):
        assert np.isnan(tilt_from_quaternion(strange, frame)).all()
