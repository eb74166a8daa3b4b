"""The linear aircraft near level flight that gains are designed for and checked against, and what is put around it."""

from __future__ import annotations

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.linear_model import Derivatives, DimensionalScales, LinearModel, linear_model
from sysid_node.errors import InputError

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


def check(aircraft: Aircraft) -> None:
    """Raise InputError where the aircraft file lacks what a controller needs."""
    missing = [name for name in CONTROLS if name not in aircraft.controls]
    missing += [name for name in _NEEDED if name not in aircraft.derivatives]
    missing += [n for n in ("Ixx", "Iyy", "Izz") if not np.isfinite(getattr(aircraft.inertia, n))]
    if missing:
        raise InputError(f"aircraft {aircraft.name!r}: a controller needs {', '.join(missing)}; complete the file")


def longitudinal(derivatives: Derivatives, condition: DimensionalScales) -> LinearModel:
    """The short period. States alpha (rad), q (rad/s); input elevator (rad)."""
    return linear_model(derivatives, condition, 0.0, ("alpha", "q"), ("de",))


def lateral(derivatives: Derivatives, condition: DimensionalScales, alpha: float) -> LinearModel:
    """The lateral-directional motion. States beta (rad), p, r (rad/s), phi (rad); inputs aileron, rudder (rad).

    ``alpha`` (rad) is that of level flight.
    """
    return linear_model(derivatives, condition, alpha, ("beta", "p", "r", "phi"), ("da", "dr"))


def with_integral(plant: LinearModel, state: int) -> LinearModel:
    """The plant with the integral of one of its states behind the others."""
    *batch, n, m = plant.B.shape
    A, B = np.zeros((*batch, n + 1, n + 1)), np.zeros((*batch, n + 1, m))
    A[..., :n, :n], B[..., :n, :] = plant.A, plant.B
    A[..., n, state] = 1.0
    return LinearModel(A, B)


def with_attitude(plant: LinearModel) -> LinearModel:
    """The longitudinal plant with theta (rad) behind alpha and q."""
    return with_integral(plant, 1)


def behind_actuators(plant: LinearModel, lag: float) -> LinearModel:
    """The plant with its surfaces as states behind the others, first-order ``lag`` (s) behind their commands."""
    *batch, n, m = plant.B.shape
    A, B = np.zeros((*batch, n + m, n + m)), np.zeros((*batch, n + m, m))
    A[..., :n, :n], A[..., :n, n:] = plant.A, plant.B
    A[..., n:, n:], B[..., n:, :] = -np.eye(m) / lag, np.eye(m) / lag
    return LinearModel(A, B)
