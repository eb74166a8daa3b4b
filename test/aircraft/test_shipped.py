"""The aircraft that come with the package: signs, trim within limits, modes of a sensible aircraft of that size."""

import math

import numpy as np
import pytest

from sysid_node.aircraft.load import aircraft_folders, load_aircraft
from sysid_node.aircraft.names import STANDARD_DERIVATIVES

NAMES = sorted(path.stem for path in aircraft_folders()[0].glob("*.yaml"))
G = 9.80665


@pytest.fixture(params=NAMES)
def aircraft(request):
    return load_aircraft(request.param)


def values(aircraft):
    return {name: derivative.value for name, derivative in aircraft.derivatives.items()}


def trim(aircraft, airspeed):
    """alpha, elevator, thrust in level flight of the linear model, thrust along x: a fixed point."""
    c = values(aircraft)
    qS = 0.5 * aircraft.reference.air_density * airspeed**2 * aircraft.geometry.S
    alpha = elevator = thrust = 0.0
    for _ in range(50):
        CL = (aircraft.mass * G - thrust * math.sin(alpha)) / qS
        alpha, elevator = np.linalg.solve(
            [[c["CL_alpha"], c["CL_de"]], [c["Cm_alpha"], c["Cm_de"]]], [CL - c["CL_0"], -c["Cm_0"]]
        )
        thrust = qS * (c["CD_0"] + c["CD_alpha"] * alpha + c["CD_de"] * elevator) / math.cos(alpha)
    return alpha, elevator, thrust


def short_period(aircraft):
    """Eigenvalues of alpha, q (Nelson, Flight Stability and Automatic Control, 2nd ed., sect. 4.4)."""
    c, g, V = values(aircraft), aircraft.geometry, aircraft.reference.airspeed
    qS = 0.5 * aircraft.reference.air_density * V**2 * g.S
    Z, M, hat = qS / (aircraft.mass * V), qS * g.cbar / aircraft.inertia.Iyy, g.cbar / (2 * V)
    A = [[-Z * c["CL_alpha"], 1 - Z * c["CL_q"] * hat], [M * c["Cm_alpha"], M * c["Cm_q"] * hat]]
    return np.linalg.eigvals(np.array(A))


def lateral(aircraft):
    """Eigenvalues of beta, p, r, phi about level flight at alpha (Nelson, sect. 5.3, body axes with Ixz)."""
    c, g, V, I = values(aircraft), aircraft.geometry, aircraft.reference.airspeed, aircraft.inertia
    alpha = trim(aircraft, V)[0]
    qS, hat = 0.5 * aircraft.reference.air_density * V**2 * g.S, g.b / (2 * V)
    Y = qS / (aircraft.mass * V)
    inertia = np.array([[I.Ixx, -I.Ixz], [-I.Ixz, I.Izz]])
    rows = qS * g.b * np.array([[c[f"{k}_beta"], c[f"{k}_p"] * hat, c[f"{k}_r"] * hat, 0.0] for k in ("Cl", "Cn")])
    side = [
        Y * c["CY_beta"],
        Y * c["CY_p"] * hat + math.sin(alpha),
        Y * c["CY_r"] * hat - math.cos(alpha),
        G / V * math.cos(alpha),
    ]
    return np.linalg.eigvals(np.vstack([side, np.linalg.solve(inertia, rows), [0.0, 1.0, math.tan(alpha), 0.0]]))


def test_the_model_is_full_with_a_tolerance_each(aircraft):
    assert tuple(aircraft.derivatives) == STANDARD_DERIVATIVES
    assert all(derivative.tolerance for derivative in aircraft.derivatives.values())
    assert "not measured" in aircraft.source


def test_signs(aircraft):
    c = values(aircraft)
    negative = "Cm_alpha Cm_q Cm_de CY_beta Cl_beta Cl_p Cl_da Cn_r Cn_dr"
    positive = "CL_alpha CL_q CL_de CD_0 CD_alpha Cn_beta CY_dr Cl_r"
    assert all(c[name] < 0 for name in negative.split())
    assert all(c[name] > 0 for name in positive.split())


@pytest.mark.parametrize("factor", [0.85, 1.0, 1.3])
def test_trims_within_limits(aircraft, factor):
    alpha, elevator, thrust = trim(aircraft, factor * aircraft.reference.airspeed)
    assert -0.05 < alpha < 0.20
    assert abs(elevator) < 0.5 * aircraft.controls["elevator"].limit
    assert 0 < thrust < 0.6 * aircraft.throttle.max_thrust


def test_lift_to_drag_ratio(aircraft):
    _, _, thrust = trim(aircraft, aircraft.reference.airspeed)
    assert 4 < aircraft.mass * G / thrust < 15


def test_short_period(aircraft):
    poles = short_period(aircraft)
    frequency, damping = abs(poles[0]) / (2 * np.pi), -poles[0].real / abs(poles[0])
    assert 0.6 < frequency < 3.0  # Hz: small aircraft are quick
    assert 0.3 < damping < 1.0


def test_lateral_modes(aircraft):
    poles = lateral(aircraft)
    oscillation = poles[np.abs(poles.imag) > 1e-6]
    assert len(oscillation) == 2
    frequency, damping = abs(oscillation[0]) / (2 * np.pi), -oscillation[0].real / abs(oscillation[0])
    assert 0.4 < frequency < 2.0
    assert 0.04 < damping < 0.6
    roll, spiral = sorted(poles[np.abs(poles.imag) <= 1e-6].real)
    assert -40 < roll < -3
    assert abs(spiral) < 0.3
