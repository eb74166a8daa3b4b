"""Triangles of a simple aircraft of given span and chord. Body axes forward-right-down, origin at the wing.

The aircraft file holds no drawing; the shape only shows attitude and deflections, at the file's span.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.view.scene import DrawnAircraft


class Mesh(NamedTuple):
    """Triangles: corners (T * 3, 3) m, and the normal of each corner's triangle (T * 3, 3)."""

    corners: Array
    normals: Array


class MovingPart(NamedTuple):
    """A part that turns: ``hinge`` (3,) m in the body, unit ``axis`` (3,), ``sign`` of its turn, control's symbol.

    The mesh is about the hinge. A turn by a positive angle about ``axis`` moves the trailing edge down or left.
    """

    name: str
    symbol: str
    hinge: Array
    axis: Array
    sign: float
    mesh: Mesh


_RIGHT, _DOWN = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
_THICKNESS = 0.12  # of plates, over the drawn chord
_WIDEST = 0.18  # drawn chord over span: a wing of low aspect ratio would hide the rest
_TUBE_SIDES = 10


def airframe(shape: DrawnAircraft) -> Mesh:
    """Fuselage, wing, tailplane and fin."""
    b, c = shape.span, _drawn_chord(shape)
    length, width = 0.72 * b, 0.35 * c
    stations = [(0.40, 0.0), (0.36, 0.45), (0.25, 0.9), (0.0, 1.0), (-0.25, 0.6), (-0.60, 0.25)]
    tube = _lathe([(x * length / 0.95, 0.5 * width * r) for x, r in stations])
    tail = -0.55 * length
    back = tail - 0.15 * c
    wing = _plate([(0.25 * c, 0.0), (0.20 * c, b / 2), (-0.45 * c, b / 2), (-0.50 * c, 0.0)], c)
    plane = _plate([(tail + 0.3 * c, 0.0), (tail + 0.2 * c, 0.17 * b), (back, 0.17 * b), (back, 0.0)], c)
    fin = _upright([(tail + 0.4 * c, 0.0), (tail + 0.1 * c, -0.14 * b), (back, -0.14 * b), (back, 0.0)], c)
    return _joined([tube, wing, _mirrored(wing), plane, _mirrored(plane), fin])


def surfaces(shape: DrawnAircraft) -> list[MovingPart]:
    """Elevator, both ailerons and rudder, of the controls that ``shape`` names."""
    b, c, tail = shape.span, _drawn_chord(shape), -0.55 * 0.72 * shape.span
    flap = [(0.0, 0.0), (0.0, 0.15 * b), (-0.25 * c, 0.15 * b), (-0.25 * c, 0.0)]
    aileron = _plate(flap, c)
    half = _plate([(0.0, 0.0), (0.0, 0.17 * b), (-0.3 * c, 0.17 * b), (-0.3 * c, 0.0)], c)
    rudder = _upright([(0.0, -0.01 * b), (0.0, -0.14 * b), (-0.35 * c, -0.14 * b), (-0.35 * c, -0.01 * b)], c)
    sign = dict(shape.signs)
    every = (
        MovingPart(
            "elevator", "de", np.array([tail - 0.15 * c, 0.0, 0.0]), _RIGHT, 1.0, _joined([half, _mirrored(half)])
        ),
        MovingPart("right_aileron", "da", np.array([-0.47 * c, 0.32 * b, 0.0]), _RIGHT, 1.0, aileron),
        MovingPart("left_aileron", "da", np.array([-0.47 * c, -0.32 * b, 0.0]), _RIGHT, -1.0, _mirrored(aileron)),
        MovingPart("rudder", "dr", np.array([tail - 0.15 * c, 0.0, 0.0]), _DOWN, 1.0, rudder),
    )
    return [part._replace(sign=part.sign * sign[part.symbol]) for part in every if part.symbol in sign]


def shape_of(span: float, chord: float, derivatives: Mapping[str, float]) -> DrawnAircraft:
    """The shape of an aircraft; each control turns as its derivative says, for signs differ between aircraft files.

    An elevator's trailing edge moves down where ``Cm_de`` is negative, the right aileron's where ``Cl_da`` is negative,
    and the rudder's to the left where ``Cn_dr`` is negative. A control without that derivative moves as if it were.
    """
    decisive = {"de": "Cm_de", "da": "Cl_da", "dr": "Cn_dr"}
    signs = {symbol: 1.0 if derivatives.get(name, -1.0) < 0.0 else -1.0 for symbol, name in decisive.items()}
    return DrawnAircraft(span, chord, signs)


def _drawn_chord(shape: DrawnAircraft) -> float:
    return min(shape.chord, _WIDEST * shape.span)


def _plate(outline: Sequence[tuple[float, float]], chord: float) -> Mesh:
    """A horizontal plate of a convex outline (x, y)."""
    half = 0.5 * _THICKNESS * chord
    return _prism(np.array([(x, y, -half) for x, y in outline]), np.array([0.0, 0.0, 2.0 * half]))


def _upright(outline: Sequence[tuple[float, float]], chord: float) -> Mesh:
    """An upright plate of a convex outline (x, z)."""
    half = 0.5 * _THICKNESS * chord
    return _prism(np.array([(x, -half, z) for x, z in outline]), np.array([0.0, 2.0 * half, 0.0]))


def _prism(outline: Array, through: Array) -> Mesh:
    """A convex polygon (K, 3), drawn out by a vector (3,)."""
    other, count = outline + through, len(outline)
    triangles = [(outline[0], outline[k], outline[k + 1]) for k in range(1, count - 1)]
    triangles += [(other[0], other[k + 1], other[k]) for k in range(1, count - 1)]
    for k in range(count):
        a, b, c, d = outline[k], outline[(k + 1) % count], other[(k + 1) % count], other[k]
        triangles += [(a, d, c), (a, c, b)]
    return _outward(np.array(triangles))


def _lathe(stations: Sequence[tuple[float, float]]) -> Mesh:
    """A body of revolution about x, of stations (x, radius)."""
    angles = np.linspace(0.0, 2.0 * np.pi, _TUBE_SIDES + 1)
    rings = [np.column_stack([np.full_like(angles, x), r * np.cos(angles), r * np.sin(angles)]) for x, r in stations]
    triangles = []
    for front, back in pairwise(rings):
        for k in range(_TUBE_SIDES):
            triangles += [(front[k], back[k], back[k + 1]), (front[k], back[k + 1], front[k + 1])]
    return _outward(np.array(triangles))


def _outward(triangles: Array) -> Mesh:
    """Triangles (T, 3, 3) of a convex part, each with its normal pointing away from the part's middle."""
    normals: Array = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.linalg.norm(normals, axis=1)
    triangles, normals = triangles[size > 0.0], normals[size > 0.0] / size[size > 0.0, None]
    middle = triangles.reshape(-1, 3).mean(axis=0)
    inward: NDArray[np.bool_] = ((triangles.mean(axis=1) - middle) * normals).sum(axis=1) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    normals[inward] *= -1.0
    return Mesh(triangles.reshape(-1, 3), np.repeat(normals, 3, axis=0))


def _mirrored(mesh: Mesh) -> Mesh:
    """The mesh on the other side of the plane of symmetry."""
    flip = np.array([1.0, -1.0, 1.0])
    corners, normals = ((part * flip).reshape(-1, 3, 3)[:, ::-1].reshape(-1, 3) for part in mesh)
    return Mesh(corners, normals)


def _joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    return Mesh(*(np.concatenate(parts) for parts in zip(*meshes, strict=True)))
