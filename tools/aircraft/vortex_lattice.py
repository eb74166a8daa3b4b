"""A linear vortex lattice: forces and moments of thin lifting surfaces, and their derivatives.

Horseshoe vortices, bound at the panels' quarter chords, trailing along body x; flow tangency at the three-quarter
points, camber and flaps entering as rotated normals; forces by Kutta-Joukowski at the bound vortices with the full
local velocity (Katz & Plotkin, "Low-Speed Aerodynamics", 2nd ed., ch. 12; the same formulation as AVL and AeroSandbox).
Geometry axes: x aft, y right, z up, m. Results: CL, CD in stability axes, CY, Cl, Cm, Cn in body axes FRD.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

Array = NDArray[np.float64]
Point = tuple[float, float, float]


def flat(fraction: Array) -> Array:
    """The slope of a flat plate's camber line, zero."""
    return np.zeros_like(fraction)


@dataclass(frozen=True)
class Flap:
    """A flap behind ``hinge`` (chord fraction); it turns by ``gain`` radians per radian of its control, trailing edge
    against the section's normal (downwards on a wing drawn from left to right)."""

    control: str
    hinge: float
    gain: float = 1.0


@dataclass(frozen=True)
class Section:
    """A trapezoid between two chords, drawn such that chord direction x span direction is its normal."""

    start: Point  # leading edge of the first chord
    stop: Point
    start_chord: float
    stop_chord: float
    span_panels: int
    flaps: tuple[Flap, ...] = ()
    camber_slope: Callable[[Array], Array] = flat  # dz/dx over chord fraction
    incidence: float = 0.0  # rad, leading edge up


@dataclass(frozen=True)
class Flow:
    """Flow angles (rad), non-dimensional rates p b/2V, q cbar/2V, r b/2V, and control deflections (rad)."""

    alpha: float = 0.0
    beta: float = 0.0
    p: float = 0.0
    q: float = 0.0
    r: float = 0.0
    controls: Mapping[str, float] = field(default_factory=dict)


def mirrored(section: Section, antisymmetric: Sequence[str] = ()) -> tuple[Section, Section]:
    """The section and its image on the left; flaps of the ``antisymmetric`` controls turn the other way there."""
    flaps = tuple(Flap(f.control, f.hinge, -f.gain if f.control in antisymmetric else f.gain) for f in section.flaps)
    (x0, y0, z0), (x1, y1, z1) = section.start, section.stop
    left = Section(
        start=(x1, -y1, z1),
        stop=(x0, -y0, z0),
        start_chord=section.stop_chord,
        stop_chord=section.start_chord,
        span_panels=section.span_panels,
        flaps=flaps,
        camber_slope=section.camber_slope,
        incidence=section.incidence,
    )
    return left, section


@dataclass(frozen=True)
class _Panels:
    """Panel corners and flow-tangency data of all sections, (N, 3) or (N,)."""

    left: Array  # bound vortex, first end
    right: Array
    collocation: Array
    normal: Array  # undeflected, camber and incidence included
    chordwise: Array  # unit vectors
    gains: Mapping[str, Array]  # control -> rad of flap per rad of control

    @property
    def bound(self) -> Array:
        return 0.5 * (self.left + self.right)


class VortexLattice:
    """The lattice of ``sections``, made non-dimensional by S (m^2), b, cbar (m), moments about ``cg`` (m)."""

    def __init__(
        self, sections: Sequence[Section], S: float, b: float, cbar: float, cg: Point, chord_panels: int = 10
    ) -> None:
        self.S, self.b, self.cbar, self.cg = S, b, cbar, np.array(cg)
        self.panels = _merge([_panels(section, chord_panels) for section in sections])
        influence = _influence(self.panels, self.panels.collocation)
        self._factors = lu_factor(np.einsum("ijk,ik->ij", influence, self.panels.normal))
        self._at_bound = _influence(self.panels, self.panels.bound)

    def coefficients(self, flow: Flow) -> dict[str, float]:
        """CL, CD (induced), CY, Cl, Cm, Cn in the given flow; linear in circulation, exact in its forces."""
        onset, onset_bound = (self._onset(flow, points) for points in (self.panels.collocation, self.panels.bound))
        # Flaps turn the normals in the boundary condition only, to first order: the influence stays as factorised.
        normal = self.panels.normal + self.panels.chordwise * self._deflection(flow)[:, None]
        circulation = lu_solve(self._factors, -np.einsum("ij,ij->i", onset, normal))
        velocity = onset_bound + np.einsum("ijk,j->ik", self._at_bound, circulation)
        force = 2 * circulation[:, None] * np.cross(velocity, self.panels.right - self.panels.left) / self.S
        moment = np.cross(self.panels.bound - self.cg, force).sum(axis=0)
        return self._body_axes(force.sum(axis=0), moment, flow.alpha)

    def _deflection(self, flow: Flow) -> Array:
        total = np.zeros(len(self.panels.left))
        for control, angle in flow.controls.items():
            total += self.panels.gains[control] * angle
        return total

    def _onset(self, flow: Flow, points: Array) -> Array:
        """Velocity of the undisturbed air past the points, over airspeed."""
        ca, sa, cb, sb = np.cos(flow.alpha), np.sin(flow.alpha), np.cos(flow.beta), np.sin(flow.beta)
        rate = np.array([-2 * flow.p / self.b, 2 * flow.q / self.cbar, -2 * flow.r / self.b])
        return np.array([ca * cb, -sb, sa * cb]) - np.cross(rate, points - self.cg)

    def _body_axes(self, force: Array, moment: Array, alpha: float) -> dict[str, float]:
        ca, sa = np.cos(alpha), np.sin(alpha)
        return {
            "CL": float(force[2] * ca - force[0] * sa),
            "CD": float(force[0] * ca + force[2] * sa),
            "CY": float(force[1]),
            "Cl": float(-moment[0] / self.b),
            "Cm": float(moment[1] / self.cbar),
            "Cn": float(-moment[2] / self.b),
        }


def _panels(section: Section, n_chord: int) -> _Panels:
    """Panels of equal width along the chord and along the section's span."""
    eta = np.linspace(0, 1, section.span_panels + 1)
    edge = np.array(section.start) + eta[:, None] * (np.array(section.stop) - np.array(section.start))
    chord = section.start_chord + eta * (section.stop_chord - section.start_chord)
    quarter = (np.arange(n_chord) + 0.25) / n_chord
    control = (np.arange(n_chord) + 0.75) / n_chord
    aft = np.array([1.0, 0.0, 0.0])

    def line(fraction: Array, leading: Array, c: Array) -> Array:
        return np.asarray(leading[None] + fraction[:, None, None] * c[None, :, None] * aft).reshape(-1, 3)

    left, right = line(quarter, edge[:-1], chord[:-1]), line(quarter, edge[1:], chord[1:])
    middle = line(control, 0.5 * (edge[:-1] + edge[1:]), 0.5 * (chord[:-1] + chord[1:]))
    span = (edge[-1] - edge[0]) * [0.0, 1.0, 1.0]
    normal = np.cross(aft, span / np.linalg.norm(span))
    fraction = np.repeat(control, section.span_panels)
    slope = section.camber_slope(fraction) - section.incidence
    # A flap acts where its panel's control point lies behind the hinge.
    gains: dict[str, Array] = {}
    for flap in section.flaps:
        gains[flap.control] = np.where(fraction > flap.hinge, flap.gain, 0.0)
    count = len(left)
    chordwise = np.tile(aft, (count, 1))
    return _Panels(left, right, middle, np.tile(normal, (count, 1)) - slope[:, None] * chordwise, chordwise, gains)


def _merge(parts: Sequence[_Panels]) -> _Panels:
    names = {name for part in parts for name in part.gains}
    gains = {n: np.concatenate([part.gains.get(n, np.zeros(len(part.left))) for part in parts]) for n in names}
    left, right, collocation, normal, chordwise = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("left", "right", "collocation", "normal", "chordwise")
    )
    return _Panels(left, right, collocation, normal, chordwise, gains)


def _influence(panels: _Panels, points: Array) -> Array:
    """Velocity (M, N, 3) at the points due to each horseshoe at unit circulation."""
    to_left = points[:, None] - panels.left
    to_right = points[:, None] - panels.right
    return (_segment(to_left, to_right) - _leg(to_left) + _leg(to_right)) / (4 * np.pi)


def _segment(r1: Array, r2: Array) -> Array:
    n1, n2 = np.linalg.norm(r1, axis=-1), np.linalg.norm(r2, axis=-1)
    bottom = n1 * n2 * (n1 * n2 + np.einsum("ijk,ijk->ij", r1, r2))
    own = bottom < 1e-12  # a point on the segment itself: no velocity of its own
    scale = np.where(own, 0.0, (n1 + n2) / np.where(own, 1.0, bottom))
    return np.cross(r1, r2) * scale[..., None]


def _leg(r: Array) -> Array:
    """Semi-infinite vortex from the origin along +x; a point on it gets no velocity."""
    norm = np.linalg.norm(r, axis=-1)
    bottom = norm * (norm - r[..., 0])
    own = bottom < 1e-12
    scale = np.where(own, 0.0, 1.0 / np.where(own, 1.0, bottom))
    return np.cross(np.array([1.0, 0.0, 0.0]), r) * scale[..., None]
