"""What an aircraft file says beyond derivatives, as the simulator flies it: tables, servos of second order."""

from dataclasses import replace
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from sysid_node.aircraft.model import LookupTable, UncertainValue
from sysid_node.dynamics.atmosphere import speed_of_sound
from sysid_node.sim import Simulator
from sysid_node.sim.effects import actuator_lag
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie
from sysid_node.sim.signals.time_shift import shift_columns, shift_linear


@pytest.mark.parametrize("damping", [0.05, 0.7, 0.9999999, 1.0, 1.0000001, 3.0])
@pytest.mark.parametrize("tau", [0.008, 0.05, 0.3])
def test_a_servo_of_second_order_is_scipys(tau, damping):
    """T^2 x'' + 2 damping T x' + x = u for a command that is linear between samples."""
    step, time = 0.01, np.arange(120) * 0.01
    command = np.random.default_rng(1).standard_normal(time.size)
    system = StateSpace([[0.0, 1.0], [-1 / tau**2, -2 * damping / tau]], [[0.0], [1 / tau**2]], [[1.0, 0.0]], [[0.0]])
    _, expected, _ = lsim(system, command, time, X0=[command[0], 0.0])
    past = actuator_lag.transition(jnp.asarray(tau), jnp.asarray(damping), jnp.asarray(step))
    x, rate, found = command[0], 0.0, [command[0]]
    for before, now in pairwise(command):
        x, rate = actuator_lag.advance(past, x, rate, before, now, step)
        found.append(x)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_without_damping_the_lag_is_of_first_order_and_its_slope_at_zero_is_a_delays():
    step = jnp.asarray(0.01)

    def follow(tau):
        past = actuator_lag.transition(tau, jnp.zeros(()), step)
        return actuator_lag.advance(past, 0.2, 0.0, 0.2, 0.3, step)[0]

    np.testing.assert_allclose(follow(jnp.asarray(0.0)), 0.3, atol=1e-15)
    np.testing.assert_allclose(jax.grad(follow)(0.0), -(0.3 - 0.2) / 0.01)
    decay = np.exp(-0.01 / 0.05)
    np.testing.assert_allclose(follow(jnp.asarray(0.05)), 0.3 - 0.5 + decay * 0.5, atol=1e-12)


def test_columns_are_shifted_each_by_its_own_delay():
    series, late = np.random.default_rng(2).standard_normal((40, 3)), jnp.array([0.3, 2.6, 0.3])
    each = np.column_stack([shift_linear(series[:, i], late[i]) for i in range(3)])
    np.testing.assert_allclose(shift_columns(jnp.asarray(series), late), each, atol=1e-15)
    slopes = jax.jacfwd(lambda x: shift_columns(jnp.asarray(series), x))(jnp.array([0.3, 0.3, 0.3]))
    one = jax.jacfwd(lambda x: shift_linear(jnp.asarray(series[:, 1]), x))(0.3)
    np.testing.assert_allclose(slopes[:, 1, 1], one, atol=1e-14)
    assert not slopes[:, 0, 1].any()


def moves(simulator, seconds=8.0):
    time = np.arange(int(seconds * simulator.rate)) * simulator.step
    wave = 0.03 * np.sin(2.0 * time) * np.minimum(time, 1.0)
    return np.column_stack([wave, 0.5 * wave, 0.3 * wave, 0.0 * wave])


def flown(aircraft, effects=()):
    simulator = Simulator(aircraft)
    return fly_sortie(simulator, moves(simulator), SortieConditions(list(effects), noise=0.0))


@pytest.mark.slow
def test_a_straight_table_is_a_derivative(aircraft):
    """A table that is linear over the flight's range adds its slope to the derivative."""
    alpha, de = np.array([-0.5, 0.0, 0.8]), np.array([-0.5, 0.5])
    one = LookupTable("Cm", ("alpha",), (tuple(alpha),), tuple(-0.05 * alpha))
    two = LookupTable(
        "CL", ("alpha", "de"), (tuple(alpha), tuple(de)), tuple(map(tuple, 0.2 * alpha[:, None] + 0.1 * de))
    )
    tabled = flown(replace(aircraft, tables=(one, two)))
    error = "derivative_error:Cm_alpha=-0.05:CL_alpha=0.2:CL_de=0.1"
    direct = flown(aircraft, [error])
    np.testing.assert_allclose(tabled.flight.coefficients, direct.flight.coefficients, atol=1e-9)


@pytest.mark.slow
def test_tables_over_airspeed_and_mach_agree(aircraft):
    sound = float(speed_of_sound(aircraft.reference.air_density, np))
    speeds = np.array([10.0, 18.0, 30.0])
    values = (0.0, 0.01, 0.05)
    by_speed = flown(replace(aircraft, tables=(LookupTable("CD", ("V",), (tuple(speeds),), values),)))
    by_mach = flown(replace(aircraft, tables=(LookupTable("CD", ("Mach",), (tuple(speeds / sound),), values),)))
    assert np.abs(by_speed.flight.coefficients - flown(aircraft).flight.coefficients)[:, 1].max() > 0.005
    np.testing.assert_allclose(by_speed.flight.coefficients, by_mach.flight.coefficients, atol=2e-4)
    assert sound == pytest.approx(340.3, rel=0.01)


@pytest.mark.slow
def test_a_table_over_the_throttle_has_the_motors_lag(aircraft):
    """By NumPy's interpolation at the motor's thrust, not at the commanded one; the side force has no other part."""
    table = LookupTable("CY", ("throttle",), ((0.0, 0.1, 1.0),), (-0.01, 0.0, 0.05))
    one = {name: d for name, d in aircraft.derivatives.items() if not name.startswith("CY")}
    simulator = Simulator(replace(aircraft, derivatives=one, tables=(table,)))
    moved = moves(simulator)
    moved[200:, -1] = 5.0
    flight = fly_sortie(simulator, moved, SortieConditions(["motor_lag:time_constant=0.5"], noise=0.0)).flight
    full = aircraft.throttle.max_thrust
    expected, unlagged = (np.interp(x[:, -1] / full, *table.points, table.values)
                          for x in (flight.surfaces, flight.commands))  # fmt: skip
    np.testing.assert_allclose(flight.coefficients[:, 2], expected, atol=1e-12)
    assert np.abs(expected - unlagged).max() > 0.003


def test_the_files_effects_fly_as_those_of_the_command(aircraft):
    lag = dict.fromkeys(("elevator", "aileron", "rudder"), UncertainValue(0.06))
    filed = flown(replace(aircraft, effects={"actuator_lag": lag}))
    given = flown(aircraft, ["actuator_lag:time_constant=0.06"])
    np.testing.assert_array_equal(filed.flight.outputs, given.flight.outputs)
    slow = flown(replace(aircraft, effects={"actuator_lag": lag}), ["actuator_lag:elevator=0.2"])
    np.testing.assert_allclose(slow.flight.surfaces[:, 1], given.flight.surfaces[:, 1], atol=2e-3)
    assert np.abs(slow.flight.surfaces - given.flight.surfaces)[:, 0].max() > 5e-3
