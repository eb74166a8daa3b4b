"""Servos between commands: analytic step responses, SciPy's exact discretisation, and limits of rate."""

import dataclasses
import math

import numpy as np
import pytest
from made_flights import made_aircraft
from scipy import signal

from sysid_node.aircraft.model import UncertainValue
from sysid_node.flight.servos import Servo, ServoState, give, move, servos_of

SECOND = 1_000_000_000  # ns


def deflections(servo, commands, stamps):
    """The deflections at stamps (ns) after commands ``(stamp ns, rad)``."""
    state, left = ServoState(servo), list(commands)
    found = []
    for stamp in stamps:
        while left and left[0][0] <= stamp:
            give(state, *left.pop(0))
        found.append(move(state, stamp)[0])
    return np.array(found)


def irregular(seed, rate, seconds):
    steps = np.random.default_rng(seed).uniform(0.5, 1.5, int(rate * seconds)) / rate
    return np.round(SECOND * (1.0 + np.cumsum(steps))).astype(int).tolist()


def test_step_response_of_first_order():
    """1 - exp(-t / T) after the delay has passed."""
    stamps = irregular(0, 200.0, 0.5)
    found = deflections(Servo(0.04, delay=0.03), [(SECOND, 0.0), (SECOND + 100_000_000, 1.0)], stamps)
    since = np.array(stamps) / SECOND - 1.13
    np.testing.assert_allclose(found, np.where(since > 0.0, 1.0 - np.exp(-since / 0.04), 0.0), atol=1e-12)


@pytest.mark.parametrize("damping", [0.3, 0.7, 1.0, 2.5])
def test_lags_agree_with_scipy(damping):
    """A held input at irregular stamps against the matrix exponential of SciPy's ``cont2discrete``."""
    T, rng = 0.03, np.random.default_rng(3)
    given, read = irregular(1, 100.0, 0.4), irregular(2, 130.0, 0.4)
    commands = list(zip(given, rng.normal(0.0, 0.1, len(given)).tolist(), strict=True))
    found = deflections(Servo(T, damping), commands, read)
    A, B = np.array([[0.0, 1.0], [-1.0 / T**2, -2.0 * damping / T]]), np.array([[0.0], [1.0 / T**2]])
    x, u, time = np.array([commands[0][1], 0.0]), commands[0][1], given[0]
    expected, left = [], commands[1:]
    for stamp in read:
        while left and left[0][0] <= stamp:
            x, time = _discrete(A, B, x, u, left[0][0] - time), left[0][0]
            u = left.pop(0)[1]
        if stamp > time:
            x, time = _discrete(A, B, x, u, stamp - time), stamp
        expected.append(x[0])
    np.testing.assert_allclose(
        found[np.array(read) >= given[0]], np.array(expected)[np.array(read) >= given[0]], atol=1e-10
    )


def _discrete(A, B, x, u, step):
    Ad, Bd, *_ = signal.cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), step / SECOND)
    return Ad @ x + Bd[:, 0] * u


def test_rate_limit():
    """Without a lag the surface moves at its largest rate until it is there."""
    stamps = [SECOND + 10_000_000 * i for i in range(40)]
    found = deflections(Servo(rate_limit=2.0), [(SECOND, 0.0), (SECOND + 100_000_000, 0.3)], stamps)
    np.testing.assert_allclose(found, np.clip(2.0 * (0.01 * np.arange(40) - 0.1), 0.0, 0.3), atol=1e-12)


def test_a_servo_without_elements_holds_the_command():
    stamps = irregular(4, 200.0, 0.2)
    commands = [(SECOND, 0.1), (SECOND + 50_000_000, -0.2)]
    found = deflections(Servo(), commands, stamps)
    np.testing.assert_array_equal(found, np.where(np.array(stamps) >= commands[1][0], -0.2, 0.1))


@pytest.mark.parametrize("servo", [Servo(), Servo(0.02), Servo(0.02, 0.6), Servo(0.03, 1.4), Servo(0.02, 0.0, 0.013)])
def test_the_excess_makes_up_the_area(servo):
    """The trapezoids of rare samples and their excess against the area under the same deflection, read finely.

    A step of 0.15 rad between two fine readings 10 us apart is uncertain by 0.15 x 5 us / 10 ms = 7.5e-5.
    """
    commands = [(SECOND, 0.0), (SECOND + 33_000_000, 0.1), (SECOND + 61_000_000, -0.05)]
    rare, fine = (np.arange(SECOND, SECOND + 150_000_001, step) for step in (10_000_000, 10_000))
    states = ServoState(servo), ServoState(servo)
    for state in states:
        for command in commands:
            give(state, *command)
    rows = np.array([move(states[0], stamp) for stamp in rare.tolist()])
    exact = np.array([move(states[1], stamp)[0] for stamp in fine.tolist()])
    areas = 0.5 * (rows[1:, 0] + rows[:-1, 0]) + rows[1:, 1]
    expected = [exact[i : i + 1001] for i in range(0, 15000, 1000)]
    np.testing.assert_allclose(areas, [np.trapezoid(part) / 1000 for part in expected], atol=1e-4)


def test_unknown_thrust_stays_unknown():
    assert math.isnan(deflections(Servo(0.1), [(SECOND, math.nan)], [SECOND + 1])[0])


def test_servos_of_the_aircraft_file():
    """What the file states, by control, and nothing where it is silent."""
    effects: dict[str, dict[str, UncertainValue]] = {
        "actuator_lag": {"elevator": UncertainValue(0.05), "damping": UncertainValue(0.7)},
        "actuator_rate_limit": {"rudder": UncertainValue(3.0)},
        "command_delay": {"aileron": UncertainValue(0.02)},
        "motor_lag": {"time_constant": UncertainValue(0.15)},
    }
    aircraft = dataclasses.replace(made_aircraft(), effects=effects)
    motor, elevator, aileron, rudder = servos_of(aircraft)
    assert motor == Servo(0.15)
    assert elevator == Servo(0.05, 0.7)
    assert aileron == Servo(delay=0.02)
    assert rudder == Servo(rate_limit=3.0)
    assert servos_of(made_aircraft()) == (Servo(),) * 4
