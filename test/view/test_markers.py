"""The live aircraft in ROS's axes: world east-north-up, body forward-left-up (REP-103)."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sysid_node.cli.live.markers import NEEDED
from sysid_node.view.aircraft_mesh import shape_of, surfaces
from sysid_node.view.markers import TRAIL, Trail, fixed_parts, moving_parts, pose_of
from sysid_node.view.scene import GREY, Body

MISSING = [name for name in NEEDED if find_spec(name) is None]
FLU_OF_FRD = np.diag([1.0, -1.0, -1.0])
ENU_OF_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def body_at(position: list[float], attitude: Rotation, time: float = 0.0) -> Body:
    """A body at one time; ``attitude`` turns forward-right-down vectors into north-east-down ones."""
    x, y, z, w = attitude.as_quat()
    return Body("measured", GREY, np.array([time]), np.array([position]), np.array([[w, x, y, z]]))


@pytest.mark.parametrize("euler", [(0.0, 0.0, 0.0), (0.3, 0.2, -2.0), (-1.0, -0.7, 1.4)])
def test_the_pose_turns_vectors_as_the_attitude_does(euler: tuple[float, float, float]) -> None:
    """The same rotation in other axes: R_enu_flu = E R_ned_frd F, with E and F the half turns between the axes."""
    attitude = Rotation.from_euler("ZYX", euler[::-1])
    pose = pose_of(body_at([10.0, 20.0, -30.0], attitude))
    np.testing.assert_allclose(pose.position, [20.0, 10.0, 30.0])
    expected = ENU_OF_NED @ attitude.as_matrix() @ FLU_OF_FRD
    np.testing.assert_allclose(Rotation.from_quat(pose.orientation).as_matrix(), expected, atol=1e-12)


def test_controls_turn_about_their_hinges() -> None:
    """Each corner by scipy's rotation in forward-right-down axes, then in forward-left-up axes."""
    shape, deflections = shape_of(2.0, 0.3, {}), {"de": 0.2, "da": -0.1}
    for part, surface in zip(moving_parts(shape, deflections), surfaces(shape), strict=True):
        angle = surface.sign * deflections.get(surface.symbol, 0.0)
        turned = Rotation.from_rotvec(angle * surface.axis).apply(surface.mesh.corners) + surface.hinge
        placed = Rotation.from_quat(part.pose.orientation).apply(part.corners) + part.pose.position
        np.testing.assert_allclose(placed, turned @ FLU_OF_FRD, atol=1e-12)


def test_the_fin_stands_up() -> None:
    corners = fixed_parts(shape_of(2.0, 0.3, {})).corners
    assert corners[:, 2].max() > -corners[:, 2].min()


def test_the_trail_holds_the_last_seconds_and_begins_anew_with_the_clock() -> None:
    trail = Trail()
    for time in np.arange(0.0, 2.0 * TRAIL, 0.02):
        trail.add(body_at([time, 0.0, 0.0], Rotation.identity(), time))
    norths = [point[1] for point in trail.points]
    assert norths[0] >= TRAIL - 0.2
    assert norths[-1] == pytest.approx(2.0 * TRAIL, abs=0.15)
    assert np.diff(norths) == pytest.approx(0.1, abs=0.021)
    trail.add(body_at([0.0, 0.0, 0.0], Rotation.identity(), 1.0))
    assert len(trail.points) == 1


@pytest.mark.skipif(not MISSING or find_spec("rclpy") is None, reason="needs ROS without tf2_msgs")
def test_without_the_message_packages_one_line_says_so() -> None:
    program = [sys.executable, "-c", "from sysid_node.cli.live.markers import main; main()"]
    done = subprocess.run(program, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    said = [line for line in done.stderr.splitlines() if line]
    assert len(said) == 1
    assert all(name in said[0] for name in MISSING)
    assert "apt install" in said[0]
