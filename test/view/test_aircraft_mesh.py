"""The drawn aircraft: its measures, and which way its controls move."""

import numpy as np
import pytest

from sysid_node.view.aircraft_mesh import airframe, shape_of, surfaces


def turned(points: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """Points (N, 3) turned about an axis through the origin: Rodrigues' formula."""
    cosine, sine = np.cos(angle), np.sin(angle)
    along = (points @ axis)[:, None] * axis
    return points * cosine + np.cross(axis, points) * sine + along * (1 - cosine)


def test_the_wing_is_as_wide_as_the_span() -> None:
    corners, normals = airframe(shape_of(3.0, 0.3, {}))
    assert np.ptp(corners[:, 1]) == pytest.approx(3.0)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    np.testing.assert_allclose(corners[:, 1].mean(), 0.0, atol=1e-9)  # the same on both sides


@pytest.mark.parametrize(("derivative", "moved", "part", "axis"), [
    ("Cm_de", "de", "elevator", 2), ("Cl_da", "da", "right_aileron", 2), ("Cn_dr", "dr", "rudder", 1),
])  # fmt: skip
@pytest.mark.parametrize("value", [-0.3, 0.3])
def test_a_control_moves_as_its_derivative_says(
    derivative: str, moved: str, part: str, axis: int, value: float
) -> None:
    """A moment that is nose down, to the left or nose left needs a trailing edge down (+z), down, or left (-y)."""
    shape = shape_of(2.0, 0.3, {derivative: value})
    surface = next(s for s in surfaces(shape) if s.name == part)
    assert surface.symbol == moved
    edge = surface.mesh.corners[surface.mesh.corners[:, 0] == surface.mesh.corners[:, 0].min()]
    shift = (turned(edge, surface.axis, surface.sign * 0.2) - edge)[:, axis].mean()
    expected = 1.0 if axis == 2 else -1.0
    assert np.sign(shift) == expected * (1.0 if value < 0.0 else -1.0)


def test_ailerons_move_against_each_other() -> None:
    left, right = (
        next(s for s in surfaces(shape_of(2.0, 0.3, {})) if s.name == n) for n in ("left_aileron", "right_aileron")
    )
    assert left.sign == -right.sign
