"""The equations of motion. Truth: cases with an analytic solution, and what every free body conserves."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sysid_node.aircraft.model import Inertia
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.dynamics.attitude import down_of_euler, euler_rates, quaternion_rate, to_earth
from sysid_node.dynamics.rigid_body import (
    MassProperties,
    accelerations,
    angular_acceleration,
    angular_momentum,
    gyroscopic_moment,
    known_moments,
    moment_for,
    velocity_rate,
)
from sysid_node.dynamics.vector import Vector

INERTIA = Inertia(0.3, 0.35, 0.6, 0.02)
NOTHING = Vector(0.0, 0.0, 0.0)


def test_a_symmetric_body_precesses_at_the_rate_of_eulers_solution() -> None:
    """Free of moments with Iyy = Izz, q and r turn at (Ixx - Iyy) / Iyy p, and p is constant (Goldstein, sec. 5.6)."""
    inertia = Inertia(0.2, 0.5, 0.5, 0.0)
    p, spin = 3.0, (0.2 - 0.5) / 0.5 * 3.0
    found = solve_ivp(
        lambda _, w: angular_acceleration(inertia, Vector(*w), NOTHING),
        (0.0, 2.0),
        (p, 0.4, 0.0),
        rtol=1e-11,
        atol=1e-13,
    ).y[:, -1]
    np.testing.assert_allclose(found, (p, 0.4 * np.cos(2.0 * spin), 0.4 * np.sin(2.0 * spin)), atol=1e-9)


def test_a_free_body_keeps_energy_and_angular_momentum() -> None:
    def rate(_: float, x: np.ndarray) -> np.ndarray:
        rates = Vector(*x[4:])
        return np.array([*quaternion_rate(tuple(x[:4]), rates), *angular_acceleration(INERTIA, rates, NOTHING)])

    start = np.array([1.0, 0.0, 0.0, 0.0, 1.5, -0.8, 2.2])
    end = solve_ivp(rate, (0.0, 5.0), start, rtol=1e-11, atol=1e-12).y[:, -1]
    momenta = [to_earth(tuple(x[:4]), Vector(*angular_momentum(INERTIA, Vector(*x[4:])))) for x in (start, end)]
    np.testing.assert_allclose(momenta[1], momenta[0], atol=1e-8)
    energies = [x[4:] @ np.array(angular_momentum(INERTIA, Vector(*x[4:]))) for x in (start, end)]
    assert energies[1] == pytest.approx(energies[0], rel=1e-9)
    assert not np.allclose(end[4:], start[4:], atol=0.1)  # it does tumble


def test_the_moment_for_an_acceleration_makes_it() -> None:
    rates, acceleration = Vector(0.4, -0.6, 0.9), Vector(3.0, -1.0, 2.0)
    moment = moment_for(INERTIA, rates, acceleration)
    np.testing.assert_allclose(angular_acceleration(INERTIA, rates, moment), acceleration, rtol=1e-13)
    tensor = np.array([[0.3, 0.0, -0.02], [0.0, 0.35, 0.0], [-0.02, 0.0, 0.6]])
    np.testing.assert_allclose(moment, tensor @ acceleration + np.cross(rates, tensor @ rates), rtol=1e-13)
    np.testing.assert_allclose(gyroscopic_moment(INERTIA, rates), np.cross(rates, tensor @ rates), rtol=1e-13)


def test_a_steady_coordinated_turn_needs_a_load_factor_of_one_over_cos_bank() -> None:
    """Level turn of bank phi at constant speed: heading rate g tan(phi) / V, specific force g / cos(phi) along -z."""
    bank, speed = 0.6, 25.0
    turn = GRAVITY * np.tan(bank) / speed
    rates = Vector(0.0, turn * np.sin(bank), turn * np.cos(bank))
    np.testing.assert_allclose(euler_rates(bank, 0.0, rates, np), (0.0, 0.0, turn), atol=1e-15)
    force = Vector(0.0, 0.0, -GRAVITY / np.cos(bank))
    rate = velocity_rate(force, down_of_euler(bank, 0.0, np), rates, (speed, 0.0, 0.0))
    np.testing.assert_allclose(rate, (0.0, 0.0, 0.0), atol=1e-13)


def test_a_force_at_the_files_cg_turns_a_body_whose_cg_is_elsewhere() -> None:
    body = MassProperties(4.0, Vector(0.1, 0.0, 0.0), 0.3, 0.35, 0.6, 0.0)
    force, acceleration = accelerations(body, NOTHING, Vector(0.0, 0.0, -8.0), NOTHING)
    np.testing.assert_allclose(force, (0.0, 0.0, -2.0))
    # lift behind the centre of gravity pitches the nose down
    np.testing.assert_allclose(acceleration, (0.0, -8.0 * 0.1 / 0.35, 0.0))


def test_unknown_moments_leave_their_products_of_rates_out() -> None:
    assert known_moments(Inertia(float("nan"), 0.35, float("nan"), 0.0)) == Inertia(0.0, 0.35, 0.0, 0.0)
