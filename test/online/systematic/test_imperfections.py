"""What is believed of servos before the flight, against the definitions of their lateness.

Truth: a servo of second order has the lateness 2 d T (``servo_model``), and a Monte Carlo draws T and d.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from plant import made_aircraft

from sysid_node.aircraft.model import UncertainValue
from sysid_node.online.frequency.regression_signals import layout
from sysid_node.online.systematic.imperfections import Imperfections, imperfections

CONTROLS = ("elevator", "aileron", "rudder")
T, D = 1.0 / (2.0 * math.pi * 3.0), 0.9  # s, 1: servos of 3 Hz


def believed(time_tolerance: float, damping_tolerance: float | None, damping: float = D) -> Imperfections:
    lags = dict.fromkeys(CONTROLS, UncertainValue(T, time_tolerance))
    if damping_tolerance is not None:
        lags["damping"] = UncertainValue(damping, damping_tolerance)
    aircraft = replace(made_aircraft(), effects={"actuator_lag": lags})
    found = imperfections(aircraft, layout(aircraft), commanded=True, positions=False)
    assert found is not None
    return found


def drawn(time_tolerance: float, damping_tolerance: float, count: int = 200_000) -> np.ndarray:
    """(3, count) lateness (s) of servos whose damping is the same."""
    rng = np.random.default_rng(4)
    times = T + time_tolerance * rng.standard_normal((3, count))
    return 2.0 * (D + damping_tolerance * rng.standard_normal(count)) * times


@pytest.mark.parametrize(("of_time", "of_damping"), [(0.2 * T, 0.1), (0.05 * T, 0.2), (0.1 * T, 0.0)])
def test_the_lateness_of_a_servo_of_second_order_is_twice_damping_times_time_constant(of_time, of_damping):
    found, truth = believed(of_time, of_damping), drawn(of_time, of_damping)
    np.testing.assert_allclose(found.sigmas, truth.std(axis=1), rtol=0.03)
    correlation = np.linalg.inv(found.precision)[found.servos, found.servos]
    np.testing.assert_allclose(correlation, np.corrcoef(truth), atol=0.01)


def test_a_servo_of_3_hz_is_known_to_22_ms_by_the_default_tolerances():
    """By hand: hypot(2 0.9 0.0106 s, 2 0.053 s 0.1) = 21.8 ms; cut off below zero at 4.4 of these, which is nothing."""
    lags = {"actuator_lag": {**dict.fromkeys(CONTROLS, UncertainValue(T)), "damping": UncertainValue(D)}}
    aircraft = replace(made_aircraft(), effects=lags, ideal=False)
    found = imperfections(aircraft, layout(aircraft), commanded=True, positions=False)
    assert found is not None
    np.testing.assert_allclose(found.sigmas, 0.0218, rtol=0.01)


def test_a_servo_of_first_order_is_as_late_as_its_time_constant_and_shares_nothing():
    found = believed(0.01, None)
    np.testing.assert_allclose(found.sigmas, 0.01, rtol=1e-3)
    np.testing.assert_array_equal(found.precision, np.eye(len(found.precision)))


def test_servos_that_only_their_damping_leaves_open_move_together():
    """Their correlation would be one, and has no inverse."""
    correlation = np.linalg.inv(believed(0.0, 0.1).precision)
    assert correlation[0, 1] == pytest.approx(0.99**2)


@pytest.mark.parametrize("stated", [False, True])
def test_servos_of_which_nothing_is_known_are_alike(stated):
    """In lateness, curvature and third coefficient; an aircraft has servos of one type.

    What a file states of them does not tell whether they come after messages that may be positions or commands.
    """
    lags = {"actuator_lag": dict.fromkeys(CONTROLS, UncertainValue(0.05, 0.01))} if stated else {}
    aircraft = replace(made_aircraft(), ideal=False, effects=lags)
    found = imperfections(aircraft, layout(aircraft), commanded=not stated, positions=False)
    assert found is not None
    np.testing.assert_array_equal(found.unknown, range(3))
    correlation, first = np.linalg.inv(found.precision), found.servos.start
    for order in range(3):
        block = slice(first + 3 * order, first + 3 * order + 3)
        np.testing.assert_allclose(correlation[block, block], 0.8 + 0.2 * np.eye(3), atol=1e-9)
