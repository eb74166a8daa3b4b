"""The linear model. Truth: finite differences of the nonlinear equations of motion, and the equations it solves."""

import numpy as np
import pytest
from plain import DERIVATIVES, make_aircraft

from sysid_node.dynamics.airflow import flow_rates, velocity_of
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.attitude import down_of_euler, euler_rates
from sysid_node.dynamics.coefficients import Coefficients, linear_coefficient, regressors
from sysid_node.dynamics.forces import force_and_moment
from sysid_node.dynamics.linear_model import STATES, DimensionalScales, level_flight, linear_model
from sysid_node.dynamics.rigid_body import angular_acceleration, velocity_rate
from sysid_node.dynamics.vector import Vector

AIRCRAFT = make_aircraft()
SPEED, DENSITY = 18.0, 1.2
SCALES = DimensionalScales.of(AIRCRAFT, SPEED, DENSITY)
PRESSURE_AREA = dynamic_pressure(DENSITY, SPEED) * AIRCRAFT.geometry.S


def rates(z: np.ndarray, values: dict[str, float], trim: float, elevator: float) -> np.ndarray:
    """d(alpha, q, beta, p, r, phi)/dt at constant airspeed, thrust balancing drag and what weight there is along x."""
    alpha, q, beta, p, r, phi, de, da, dr = z
    geometry, flow, turning = AIRCRAFT.geometry, (SPEED, trim + alpha, beta), Vector(p, q, r)
    x = regressors(flow, turning, geometry.b, geometry.cbar, SPEED)
    x |= {"de": elevator + de, "da": da, "dr": dr}
    terms = {
        c: [(v, n.partition("_")[2]) for n, v in values.items() if n.startswith(f"{c}_")] for c in Coefficients._fields
    }
    c = Coefficients(*(linear_coefficient(terms[name], x) for name in Coefficients._fields))._replace(CD=0.0)
    axes = np.cos(trim + alpha), np.sin(trim + alpha)
    force, moment = force_and_moment(c, axes, PRESSURE_AREA, geometry.b, geometry.cbar)
    velocity = Vector(*velocity_of(flow, np))
    moved = velocity_rate(force.times(1.0 / AIRCRAFT.mass), down_of_euler(phi, trim, np), turning, velocity)
    _, alpha_rate, beta_rate = flow_rates(velocity, moved, np)
    p_rate, q_rate, r_rate = angular_acceleration(AIRCRAFT.inertia, turning, moment)
    roll_rate, _, _ = euler_rates(phi, trim, turning, np)
    return np.array([alpha_rate, q_rate, beta_rate, p_rate, r_rate, roll_rate])


def test_the_linear_model_is_the_slope_of_the_equations_of_motion() -> None:
    weight = AIRCRAFT.mass * GRAVITY / PRESSURE_AREA
    alpha, elevator = level_flight(DERIVATIVES, weight)
    steps = 1e-5 * np.eye(9)
    slopes = np.column_stack(
        [(rates(h, DERIVATIVES, alpha, elevator) - rates(-h, DERIVATIVES, alpha, elevator)) / 2e-5 for h in steps]
    )
    model = linear_model(DERIVATIVES, SCALES, alpha)
    np.testing.assert_allclose(model.A, slopes[:, :6], atol=1e-6, rtol=1e-6)
    np.testing.assert_allclose(model.B, slopes[:, 6:], atol=1e-6, rtol=1e-6)


def test_level_flight_is_an_equilibrium() -> None:
    weight = AIRCRAFT.mass * GRAVITY / PRESSURE_AREA
    alpha, elevator = level_flight(DERIVATIVES, weight)
    np.testing.assert_allclose(rates(np.zeros(9), DERIVATIVES, alpha, elevator), 0.0, atol=1e-12)


def test_level_flight_without_an_elevator_carries_the_weight_alone() -> None:
    assert level_flight({"CL_0": 0.1, "CL_alpha": 4.0}, 0.5) == (pytest.approx(0.1), 0.0)
    assert level_flight({"CL_0": 0.1}, 0.5) == (0.0, 0.0)


def test_part_of_the_states_is_part_of_the_matrices() -> None:
    whole = linear_model(DERIVATIVES, SCALES, 0.08)
    part = linear_model(DERIVATIVES, SCALES, 0.08, ("beta", "p", "r", "phi"), ("da", "dr"))
    places = [STATES.index(name) for name in ("beta", "p", "r", "phi")]
    np.testing.assert_array_equal(part.A, whole.A[np.ix_(places, places)])
    np.testing.assert_array_equal(part.B, whole.B[np.ix_(places, [1, 2])])


def test_many_aircraft_at_once_are_each_of_them() -> None:
    several = {name: np.array([value, 1.2 * value]) for name, value in DERIVATIVES.items()}
    both = linear_model(several, SCALES, 0.08)
    one = linear_model({name: 1.2 * value for name, value in DERIVATIVES.items()}, SCALES, 0.08)
    np.testing.assert_allclose(both.A[1], one.A)
    np.testing.assert_allclose(both.B[1], one.B)
