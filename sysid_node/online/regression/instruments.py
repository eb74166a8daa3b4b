"""Instruments for the regressors: the motion that the aircraft file's model makes of the measured deflections.

The instrumental variables of Larsson & Enqvist, "Sequential aerodynamic model parameter identification" (SYSID 2012),
used by Larsson et al., "A method for improved flight testing of remotely piloted aircraft using multisine inputs"
(Aerospace 7(9), 2020): regressors made from the inputs hold neither the sensors' noise nor the motion that gusts
excite, which plain least squares takes for the effect of its regressors. The model is linear, about trim, with the
derivatives of the aircraft file; it need not be right, only correlated with the flight. Its frequency response makes
the lines of the instruments from the lines of the deflections, so that nothing has to be simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.frequency.regression_signals import Layout

Array = NDArray[np.float64]

#: Regressors that have an instrument of their own; controls are their own.
INSTRUMENTED = ("alpha", "q", "beta", "p", "r")
_STATES = 6  # alpha, q, beta, p, r, phi
_LEAK = 0.1  # 1/s: keeps spiral and phugoid, which are not in question, off the axis
_G = 9.80665


@dataclass(frozen=True)
class Auxiliary:
    """Frequency response of the instruments to the controls."""

    gains: NDArray[np.complex128]  # (F, I, m)
    controls: slice  # columns of the m controls


def auxiliary_model(aircraft: Aircraft, layout: Layout, omega: Array) -> Auxiliary | None:
    """Response at omega (F,) rad/s of the ``layout``'s instruments; None where it has none."""
    if not layout.instrumented:
        return None
    A, B, rows, scales = _linear(aircraft, layout)
    resolvent = np.linalg.inv(1j * omega[:, None, None] * np.eye(_STATES) - A)
    gains = scales[:, None] * (resolvent[:, rows] @ B)
    return Auxiliary(gains, layout.deflections)


def fill_in(model: Auxiliary, lines: Array) -> None:
    """Write the instruments of lines (..., 2F, W) into their last columns, by the deflections' columns."""
    F, made, controls = model.gains.shape
    deflections = np.empty((*lines.shape[:-2], F, controls, 1), dtype=complex)
    deflections.real[..., 0] = lines[..., :F, model.controls]
    deflections.imag[..., 0] = lines[..., F:, model.controls]
    answers = (model.gains @ deflections)[..., 0]
    lines[..., :F, -made:] = answers.real
    lines[..., F:, -made:] = answers.imag


def _linear(aircraft: Aircraft, layout: Layout) -> tuple[Array, Array, NDArray[np.intp], Array]:
    """x' = A x + B u about trim, x = alpha, q, beta, p, r, phi; rows of x and scales that the instruments are."""
    g, i, V = aircraft.geometry, aircraft.inertia, aircraft.reference.airspeed
    qS = 0.5 * aircraft.reference.air_density * V * V * g.S
    half_b, half_c = g.b / (2.0 * V), g.cbar / (2.0 * V)
    columns = {"alpha": (0, 1.0), "q": (1, half_c), "beta": (2, 1.0), "p": (3, half_b), "r": (4, half_b)}
    mass = aircraft.mass * V
    Ixx, Iyy, Izz = (value if math.isfinite(value) else math.inf for value in (i.Ixx, i.Iyy, i.Izz))
    gains = {"CL": (0, -qS / mass), "Cm": (1, qS * g.cbar / Iyy), "CY": (2, qS / mass)}
    gains |= {"Cl": (3, qS * g.b / Ixx), "Cn": (4, qS * g.b / Izz)}
    controls = layout.timed
    A, B = np.zeros((_STATES, _STATES)), np.zeros((_STATES, len(controls)))
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
    A -= _LEAK * np.eye(_STATES)
    rows = np.array([columns[r][0] for r in layout.instrumented], dtype=np.intp)
    return A, B, rows, np.array([columns[r][1] for r in layout.instrumented])
