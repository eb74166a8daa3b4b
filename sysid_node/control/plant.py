"""The aircraft near level flight, linear, from its derivatives: what gains are designed for and checked against.

Stevens, Lewis & Johnson, "Aircraft Control and Simulation", 3rd ed. (2016), sect. 3.7 and 4.1: the short period and the
lateral-directional motion at constant airspeed, thrust's part left out. Every derivative may be an array (N,): N
aircraft at once, such as the corners of an estimate's intervals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError

Array = NDArray[np.float64]
Values = Mapping[str, float | Array]

GRAVITY = 9.80665

#: What an axis's linear model is made of.
LONGITUDINAL = ("CL_alpha", "CL_q", "CL_de", "Cm_alpha", "Cm_q", "Cm_de")
LATERAL = (
    *("CY_beta", "CY_p", "CY_r", "CY_da", "CY_dr"),
    *("Cl_beta", "Cl_p", "Cl_r", "Cl_da", "Cl_dr"),
    *("Cn_beta", "Cn_p", "Cn_r", "Cn_da", "Cn_dr"),
)
#: Without these there is no control of an axis.
_NEEDED = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_r", "Cn_dr")
CONTROLS = ("elevator", "aileron", "rudder")


@dataclass(frozen=True)
class Linear:
    """dx/dt = A x + B u; A (..., n, n), B (..., n, m)."""

    A: Array
    B: Array


@dataclass(frozen=True)
class Scales:
    """From coefficients to accelerations at one flight condition: airspeed (m/s), force (1/s), rates (s), moments."""

    airspeed: float
    force: float  # qbar S / (m V), 1/s
    chord: float  # cbar / 2V, s
    span: float  # b / 2V, s
    pitch: float  # qbar S cbar / Iyy, 1/s^2
    lateral: Array  # (2, 2) inverse inertia times qbar S b, 1/s^2: of (Cl, Cn)

    @classmethod
    def of(cls, aircraft: Aircraft, airspeed: float, density: float) -> Scales:
        """At an airspeed (m/s) and air density (kg/m^3)."""
        g, i = aircraft.geometry, aircraft.inertia
        load = 0.5 * density * airspeed**2 * g.S
        inertia = np.array([[i.Ixx, -i.Ixz], [-i.Ixz, i.Izz]])
        half = 0.5 / airspeed
        return cls(
            airspeed=airspeed,
            force=load / (aircraft.mass * airspeed),
            chord=g.cbar * half,
            span=g.b * half,
            pitch=load * g.cbar / i.Iyy,
            lateral=load * g.b * np.linalg.inv(inertia),
        )


def check(aircraft: Aircraft) -> None:
    """Raise InputError where the aircraft file lacks what a controller needs."""
    missing = [name for name in CONTROLS if name not in aircraft.controls]
    missing += [name for name in _NEEDED if name not in aircraft.derivatives]
    missing += [n for n in ("Ixx", "Iyy", "Izz") if not np.isfinite(getattr(aircraft.inertia, n))]
    if missing:
        raise InputError(f"aircraft {aircraft.name!r}: a controller needs {', '.join(missing)}; complete the file")


def longitudinal(values: Values, scales: Scales) -> Linear:
    """States alpha (rad), q (rad/s); input elevator (rad)."""
    lift, pitch = (_row(values, c, ("alpha", "q", "de")) for c in ("CL", "Cm"))
    rows = np.stack([-scales.force * lift, scales.pitch * pitch], axis=-2)
    rows[..., :, 1] *= scales.chord
    rows[..., 0, 1] += 1.0
    return Linear(rows[..., :2], rows[..., 2:])


def lateral(values: Values, scales: Scales, alpha: float) -> Linear:
    """States beta (rad), p, r (rad/s), phi (rad); inputs aileron, rudder (rad). ``alpha`` (rad) of level flight."""
    side, roll, yaw = (_row(values, c, ("beta", "p", "r", "da", "dr")) for c in ("CY", "Cl", "Cn"))
    moments = np.einsum("ij,...jk->...ik", scales.lateral, np.stack([roll, yaw], axis=-2))
    rows = np.concatenate([scales.force * side[..., None, :], moments], axis=-2)
    rows[..., :, 1:3] *= scales.span
    rows[..., 0, 1] += np.sin(alpha)
    rows[..., 0, 2] -= np.cos(alpha)
    A = np.zeros((*rows.shape[:-2], 4, 4))
    A[..., :3, :3] = rows[..., :3]
    A[..., 0, 3] = GRAVITY / scales.airspeed * np.cos(alpha)
    A[..., 3, 1:3] = 1.0, np.tan(alpha)
    B = np.zeros((*rows.shape[:-2], 4, 2))
    B[..., :3, :] = rows[..., 3:]
    return Linear(A, B)


def with_integral(plant: Linear, state: int) -> Linear:
    """The plant with the integral of one of its states behind the others."""
    *batch, n, m = plant.B.shape
    A, B = np.zeros((*batch, n + 1, n + 1)), np.zeros((*batch, n + 1, m))
    A[..., :n, :n], B[..., :n, :] = plant.A, plant.B
    A[..., n, state] = 1.0
    return Linear(A, B)


def with_attitude(plant: Linear) -> Linear:
    """The longitudinal plant with theta (rad) behind alpha and q."""
    return with_integral(plant, 1)


def behind_actuators(plant: Linear, lag: float) -> Linear:
    """The plant with its surfaces as states behind the others, first-order ``lag`` (s) behind their commands."""
    *batch, n, m = plant.B.shape
    A, B = np.zeros((*batch, n + m, n + m)), np.zeros((*batch, n + m, m))
    A[..., :n, :n], A[..., :n, n:] = plant.A, plant.B
    A[..., n:, n:], B[..., n:, :] = -np.eye(m) / lag, np.eye(m) / lag
    return Linear(A, B)


def _row(values: Values, coefficient: str, regressors: Sequence[str]) -> Array:
    """(..., R) derivatives of one coefficient; those that the file does not have are zero."""
    terms = [np.asarray(values.get(f"{coefficient}_{r}", 0.0), dtype=float) for r in regressors]
    return np.stack(np.broadcast_arrays(*terms), axis=-1).copy()
