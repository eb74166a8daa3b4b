"""Coefficients, forces and accelerations against JSBSim, which has its own equations and its own atmosphere.

An aircraft of linear derivatives is exported and set into random states; JSBSim works out its forces, moments and
accelerations there, on a planet that does not turn.
"""

import numpy as np
import pytest
from plain import DERIVATIVES, make_aircraft

from sysid_node.dynamics.airflow import flow_angles, stability_axes
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.dynamics.attitude import down_of_euler, euler_rates
from sysid_node.dynamics.coefficients import Coefficients, linear_coefficient, regressors
from sysid_node.dynamics.forces import coefficients_of, force_and_moment
from sysid_node.dynamics.rigid_body import angular_acceleration, moment_for, velocity_rate
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.export.jsbsim import jsbsim_model

jsbsim_flight = pytest.importorskip("jsbsim_flight", reason="JSBSim is not installed")

FOOT, POUND = 0.3048, 4.4482216152605
AIRCRAFT = make_aircraft()
RANDOM = np.random.default_rng(5)
STATES = [
    dict(zip(("u", "v", "w", "p", "q", "r", "phi", "theta"), x, strict=True))
    for x in RANDOM.uniform((15, -2, -1, -1, -1, -1, -0.8, -0.4), (22, 2, 3, 1, 1, 1, 0.8, 0.4), (5, 8))
]


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory):
    """JSBSim with the aircraft, at sea level's gravity."""
    return jsbsim_flight.load(jsbsim_model(AIRCRAFT), "test", tmp_path_factory.mktemp("jsbsim"), 400.0, 0.0)


def put(fdm, state: dict[str, float]) -> None:
    """Into a state (m/s, rad/s, rad), at 500 m, surfaces deflected, without thrust."""
    fdm["ic/h-sl-ft"] = 500.0 / FOOT
    fdm["ic/lat-geod-deg"] = fdm["ic/long-gc-deg"] = fdm["ic/psi-true-rad"] = 0.0
    for name in ("phi", "theta"):
        fdm[f"ic/{name}-rad"] = float(state[name])
    for name in "uvw":
        fdm[f"ic/{name}-fps"] = float(state[name]) / FOOT
    for name in "pqr":
        fdm[f"ic/{name}-rad_sec"] = float(state[name])
    for name, value in zip(("elevator", "aileron", "rudder"), (0.1, -0.05, 0.08), strict=True):
        fdm[f"fcs/{name}-cmd-rad"] = value
    fdm["fcs/throttle-cmd-norm"] = 0.0
    fdm.run_ic()


def vector(fdm, names: tuple[str, str, str], unit: float) -> np.ndarray:
    return np.array([fdm[name] * unit for name in names])


@pytest.mark.parametrize("state", STATES)
def test_jsbsim_has_our_forces_and_accelerations(program, state: dict[str, float]) -> None:
    put(program, state)
    geometry, rates = AIRCRAFT.geometry, Vector(*(state[name] for name in "pqr"))
    velocity = Vector(*(state[name] for name in "uvw"))
    flow = flow_angles(velocity, np)
    density = program["atmosphere/rho-slugs_ft3"] * 515.378818
    pressure_area = dynamic_pressure(density, flow[0]) * geometry.S
    x = regressors(flow, rates, geometry.b, geometry.cbar, 18.0) | {"de": 0.1, "da": -0.05, "dr": 0.08}
    terms = {
        c: [(v, n.partition("_")[2]) for n, v in DERIVATIVES.items() if n.startswith(f"{c}_")]
        for c in Coefficients._fields
    }
    c = Coefficients(*(linear_coefficient(terms[name], x) for name in Coefficients._fields))
    axes = stability_axes(velocity, np)
    force, moment = force_and_moment(c, axes, pressure_area, geometry.b, geometry.cbar)

    theirs = vector(program, tuple(f"forces/fb{axis}-aero-lbs" for axis in "xyz"), POUND)
    np.testing.assert_allclose(force, theirs, rtol=2e-4, atol=1e-4 * np.abs(theirs).max())
    turned = vector(program, tuple(f"moments/{axis}-aero-lbsft" for axis in "lmn"), POUND * FOOT)
    np.testing.assert_allclose(moment, turned, rtol=2e-4, atol=1e-4 * np.abs(turned).max())

    spin = vector(program, tuple(f"accelerations/{axis}dot-rad_sec2" for axis in "pqr"), 1.0)
    np.testing.assert_allclose(angular_acceleration(AIRCRAFT.inertia, rates, moment), spin, rtol=1e-3, atol=2e-3)
    moved = vector(program, tuple(f"accelerations/{axis}dot-ft_sec2" for axis in "uvw"), FOOT)
    down = down_of_euler(state["phi"], state["theta"], np)
    specific = force.times(1.0 / AIRCRAFT.mass)
    np.testing.assert_allclose(velocity_rate(specific, down, rates, velocity), moved, atol=0.01)
    turning = vector(program, tuple(f"velocities/{angle}dot-rad_sec" for angle in ("phi", "theta", "psi")), 1.0)
    np.testing.assert_allclose(euler_rates(state["phi"], state["theta"], rates, np), turning, atol=1e-5)

    back = moment_for(AIRCRAFT.inertia, rates, Vector(*spin))
    found = coefficients_of(Vector(*theirs), back, axes, pressure_area, geometry.b, geometry.cbar)
    np.testing.assert_allclose(found, c, rtol=2e-3, atol=2e-4)
