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
from sysid_node.online.systematic.imperfections import CURVATURE, THIRD, Imperfections, imperfections, prior
from sysid_node.online.systematic.servo_model import ServoModel, expected_third

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


def test_what_is_believed_of_a_servos_coefficients_goes_together():
    """Gradient of the sum of squares that the estimates minimise, of servos of which nothing is known.

    Truth: the same sum written out, with the curvature about a quarter of the square of the lateness, and the third
    coefficient about what both let expect; by central differences.
    """
    aircraft = replace(made_aircraft(), ideal=False)
    found = imperfections(aircraft, layout(aircraft), commanded=True, positions=False)
    assert found is not None
    late, curved, m = np.array([0.06, 0.04, 0.05]), np.array([1.5e-3, 4e-4, 0.0]), 3
    sigmas, means, precision = prior(found, ServoModel(late, curved, np.zeros(m)))
    first = found.servos.start

    def squares(step: np.ndarray) -> float:
        L, B = late + step[first : first + m], curved + step[first + m : first + 2 * m]
        off = step / sigmas
        off[:first] -= means[:first] / sigmas[:first]
        off[first : first + m] = (L - found.expected) / sigmas[first : first + m]
        off[first + m : first + 2 * m] = (B - CURVATURE * L**2) / (CURVATURE * late**2)
        third = expected_third(late, curved) + step[first + 2 * m :]
        off[first + 2 * m :] = (third - expected_third(L, B)) / (THIRD * late**3)
        return float(off @ found.precision @ off)

    steps = 1e-4 * np.diag(sigmas)
    truth = [(squares(h) - squares(-h)) / 2e-4 for h in steps]
    assert -2.0 * precision @ (means / sigmas) == pytest.approx(truth, rel=1e-5, abs=1e-5)
