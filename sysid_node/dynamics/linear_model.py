"""The aircraft near steady, level flight: linear equations in its derivatives.

Stevens, Lewis & Johnson (2016), "Aircraft Control and Simulation", sec. 3.7 and 4.1: short period and
lateral-directional motion at constant airspeed, without the thrust's part. A derivative may be an array (N,): N
aircraft at once, such as the points of a confidence region.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft, Inertia
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure

Array = NDArray[np.float64]
Derivatives = Mapping[str, float | Array]

#: All states: rad and rad/s, perturbations about the steady flight. phi is the roll angle.
STATES = ("alpha", "q", "beta", "p", "r", "phi")


@dataclass(frozen=True)
class LinearModel:
    """dx/dt = A x + B u; A (..., n, n), B (..., n, m)."""

    A: Array
    B: Array


@dataclass(frozen=True)
class DimensionalScales:
    """From coefficients to accelerations at one airspeed (m/s) and density."""

    airspeed: float
    force: float  # qbar S / (m V), 1/s
    chord: float  # cbar / 2V, s
    span: float  # b / 2V, s
    pitch: float  # qbar S cbar / Iyy, 1/s^2
    lateral: Array  # (2, 2) inverse inertia times qbar S b, 1/s^2: of (Cl, Cn)

    @classmethod
    def of(cls, aircraft: Aircraft, airspeed: float, density: float) -> DimensionalScales:
        """At an airspeed (m/s) and air density (kg/m^3)."""
        geometry, inertia = aircraft.geometry, aircraft.inertia
        load = dynamic_pressure(density, airspeed) * geometry.S
        return cls(
            airspeed=airspeed,
            force=load / (aircraft.mass * airspeed),
            chord=geometry.cbar / (2.0 * airspeed),
            span=geometry.b / (2.0 * airspeed),
            pitch=load * geometry.cbar / inertia.Iyy,
            lateral=_lateral(inertia, load * geometry.b),
        )


def _lateral(inertia: Inertia, moment: float) -> Array:
    """(2, 2) accelerations about x and z by a moment (N m) about each; none about an axis of infinite inertia."""
    if inertia.Ixz == 0.0:
        return np.diag([moment / inertia.Ixx, moment / inertia.Izz])
    return moment * np.linalg.inv(np.array([[inertia.Ixx, -inertia.Ixz], [-inertia.Ixz, inertia.Izz]]))


def linear_model(
    derivatives: Derivatives,
    condition: DimensionalScales,
    alpha: float,
    states: Sequence[str] = STATES,
    controls: Sequence[str] = ("de", "da", "dr"),
) -> LinearModel:
    """The equations of these states (of ``STATES``), in this order; inputs are controls (rad), by symbol.

    ``alpha`` (rad) is the angle of attack of the steady flight. What couples to a state that is left out is left out;
    derivatives that are not given are zero.
    """
    moving = [state for state in states if state != "phi"]
    names = (*moving, *controls)
    reduced = {"q": condition.chord, "p": condition.span, "r": condition.span}
    gains = np.array([reduced.get(name, 1.0) for name in names])
    rows = np.broadcast_arrays(*(gains * _acceleration(state, derivatives, condition, names) for state in moving))
    n, batch = len(states), rows[0].shape[:-1]
    A, B = np.zeros((*batch, n, n)), np.zeros((*batch, n, len(controls)))
    columns = [states.index(state) for state in moving]
    for state, row in zip(moving, rows, strict=True):
        A[..., states.index(state), columns] = row[..., : len(moving)]
        B[..., states.index(state), :] = row[..., len(moving) :]
    for (state, by), value in _kinematics(condition.airspeed, alpha).items():
        if state in states and by in states:
            A[..., states.index(state), states.index(by)] += value
    return LinearModel(A, B)


def _acceleration(state: str, derivatives: Derivatives, condition: DimensionalScales, names: Sequence[str]) -> Array:
    """(..., R) what one unit of each regressor adds to a state's rate."""

    def row(coefficient: str) -> Array:
        terms = [np.asarray(derivatives.get(f"{coefficient}_{name}", 0.0), dtype=float) for name in names]
        return np.stack(np.broadcast_arrays(*terms), axis=-1)

    if state == "alpha":
        return -condition.force * row("CL")
    if state == "beta":
        return condition.force * row("CY")
    if state == "q":
        return condition.pitch * row("Cm")
    roll, yaw = condition.lateral[("p", "r").index(state)].tolist()
    return np.asarray(roll * row("Cl") + yaw * row("Cn"))


def _kinematics(airspeed: float, alpha: float) -> dict[tuple[str, str], float]:
    """Entries of A that no derivative is in: (state, by which) -> value."""
    return {
        ("alpha", "q"): 1.0,
        ("beta", "p"): float(np.sin(alpha)),
        ("beta", "r"): -float(np.cos(alpha)),
        ("beta", "phi"): GRAVITY / airspeed * float(np.cos(alpha)),
        ("phi", "p"): 1.0,
        ("phi", "r"): float(np.tan(alpha)),
    }


def level_flight(derivatives: Mapping[str, float], lift: float, speed_ratio: float = 0.0) -> tuple[float, float]:
    """Angle of attack and elevator (rad) at which CL is ``lift`` and Cm is zero; without CL_alpha or Cm_de zeros.

    Without an effective elevator, the angle that gives the lift alone. ``speed_ratio`` is V / V0, for an aircraft file
    that has CL_V and Cm_V.
    """
    d = {name: derivatives.get(name, 0.0) for name in _LEVEL}
    if not d["CL_alpha"]:
        return 0.0, 0.0
    right = (lift - d["CL_0"] - speed_ratio * d["CL_V"], -d["Cm_0"] - speed_ratio * d["Cm_V"])
    if not d["Cm_de"]:
        return right[0] / d["CL_alpha"], 0.0
    matrix = np.array([[d["CL_alpha"], d["CL_de"]], [d["Cm_alpha"], d["Cm_de"]]])
    alpha, elevator = np.linalg.solve(matrix, right)
    return float(alpha), float(elevator)


_LEVEL = ("CL_0", "CL_alpha", "CL_V", "CL_de", "Cm_0", "Cm_alpha", "Cm_V", "Cm_de")
