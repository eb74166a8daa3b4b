"""Instruments for the regressors: the motion that the aircraft file's model makes of the measured deflections.

The instrumental variables of Larsson & Enqvist, "Sequential aerodynamic model parameter identification" (SYSID 2012),
used by Larsson et al., "A method for improved flight testing of remotely piloted aircraft using multisine inputs"
(Aerospace 7(9), 2020): the regressors simulated from the inputs are free of the sensors' noise. The simulation is
linear, about trim, with the derivatives of the aircraft file; it need not be right, only correlated with the flight.
Motion that gusts excite is not in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft

Array = NDArray[np.float64]

#: Regressors that have an instrument of their own; controls are their own.
INSTRUMENTED = ("alpha", "q", "beta", "p", "r")
STATES = 6  # alpha, q, beta, p, r, phi
_LEAK = 0.1  # 1/s: keeps spiral and phugoid, which are not in question, from running away
_G = 9.80665


@dataclass(frozen=True)
class Auxiliary:
    """x' = A x + B u with x = alpha, q, beta, p, r, phi (rad, rad/s), u the controls (rad); instruments scale @ x."""

    A: Array  # (6, 6)
    B: Array  # (6, m)
    scale: Array  # (I,) non-dimensional rates
    rows: NDArray[np.intp]  # (I,) states that the instruments are


def auxiliary_model(aircraft: Aircraft) -> Auxiliary:
    """Linear model about trim at the reference condition from the aircraft file's derivatives."""
    g, i, V = aircraft.geometry, aircraft.inertia, aircraft.reference.airspeed
    qS = 0.5 * aircraft.reference.air_density * V * V * g.S
    half_b, half_c = g.b / (2.0 * V), g.cbar / (2.0 * V)
    columns = {"alpha": (0, 1.0), "q": (1, half_c), "beta": (2, 1.0), "p": (3, half_b), "r": (4, half_b)}
    mass = aircraft.mass * V
    Ixx, Iyy, Izz = (value if math.isfinite(value) else math.inf for value in (i.Ixx, i.Iyy, i.Izz))
    gains = {"CL": (0, -qS / mass), "Cm": (1, qS * g.cbar / Iyy), "CY": (2, qS / mass)}
    gains |= {"Cl": (3, qS * g.b / Ixx), "Cn": (4, qS * g.b / Izz)}
    controls = aircraft.control_symbols
    A, B = np.zeros((STATES, STATES)), np.zeros((STATES, len(controls)))
    for name, derivative in aircraft.derivatives.items():
        coefficient, _, regressor = name.partition("_")
        if coefficient not in gains:
            continue
        row, gain = gains[coefficient]
        if regressor in columns:
            A[row, columns[regressor][0]] += gain * derivative.value * columns[regressor][1]
        elif regressor in controls:
            B[row, controls.index(regressor)] += gain * derivative.value
    A[0, 1] += 1.0
    A[2, 4] -= 1.0
    A[2, 5] += _G / V
    A[5, 3] += 1.0
    A -= _LEAK * np.eye(STATES)
    ordered = dict.fromkeys(r for regressors in aircraft.structure.values() for r in regressors)
    kept = [r for r in ordered if r in INSTRUMENTED]
    scale = np.array([columns[r][1] for r in kept])
    return Auxiliary(A, B, scale, np.array([columns[r][0] for r in kept], dtype=np.intp))


@dataclass
class Track:
    """The simulated motion at the last sample."""

    x: Array  # (6,)
    controls: Array  # (m,) rad
    time: float  # s, NaN = before the first sample


def at_rest(model: Auxiliary | None) -> Track:
    """Nothing has moved yet."""
    return Track(np.zeros(STATES), np.zeros(model.B.shape[1] if model else 0), math.nan)


def instruments(model: Auxiliary, track: Track, time: float, controls: Sequence[float], max_gap: float) -> list[float]:
    """Instruments (I,) at ``time`` (s); ``track`` moves on. After a gap (s) the motion begins anew, from rest.

    Heun's rule, with controls going in a straight line.
    """
    u, step = np.array(controls), time - track.time
    if step <= max_gap:
        slope = model.A @ track.x + model.B @ track.controls
        track.x = track.x + 0.5 * step * (slope + model.A @ (track.x + step * slope) + model.B @ u)
    else:
        track.x = np.zeros(STATES)
    track.controls, track.time = u, time
    made: list[float] = (track.x[model.rows] * model.scale).tolist()
    return made
