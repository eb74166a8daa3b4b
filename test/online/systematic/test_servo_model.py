"""The response of a servo in the frequency domain against exact responses."""

import numpy as np
import pytest

from sysid_node.flight.servos import Servo
from sysid_node.online.systematic.servo_model import CUBIC, ServoModel, lateness, of_servo, rate_gain

OMEGA = np.linspace(0.6, 12.6, 25)
S = 1j * OMEGA


NONE = Servo()


def response(servo: Servo, applied: Servo = NONE) -> np.ndarray:
    """1 + j omega g of one control."""
    models = [ServoModel(*(np.array([value]) for value in of_servo(one))) for one in (servo, applied)]
    return 1.0 + S * lateness(models[0], models[1], OMEGA)[:, 0]


def test_servos_of_first_and_second_order_are_exact():
    assert np.allclose(response(Servo(0.08)), 1.0 / (1.0 + 0.08 * S))
    second = 1.0 / (1.0 + 2.0 * 0.7 * 0.03 * S + (0.03 * S) ** 2)
    assert np.allclose(response(Servo(0.03, damping=0.7)), second)


def test_a_delay_is_right_to_the_fourth_order():
    """1 / (1 + x + x^2 / 2 + x^3 / 6) differs from exp(-x) by x^4 / 24 to lowest order."""
    exact = np.exp(-0.02 * S)
    assert np.all(np.abs(response(Servo(delay=0.02)) - exact) < np.abs(0.02 * S) ** 4 / 20.0)


def test_a_lag_with_a_delay_has_the_third_coefficient_of_their_product():
    """(1 + T s) exp(D s) = 1 + (T + D) s + (T D + D^2 / 2) s^2 + (T D^2 / 2 + D^3 / 6) s^3 + ..."""
    T, D = 0.06, 0.03
    assert np.allclose(of_servo(Servo(T, delay=D)), [T + D, T * D + D**2 / 2, T * D**2 / 2 + D**3 / 6])


def test_a_moved_servo_keeps_what_the_file_says_of_the_third_coefficient():
    stated = ServoModel(*(np.array([value]) for value in of_servo(Servo(0.04, delay=0.02))))
    moved = stated.moved(np.array([0.01]), np.array([0.0]))
    assert np.allclose(moved.third - stated.third, CUBIC * 0.01 * stated.curvature)


def test_what_the_alignment_has_applied_is_taken_out():
    found = response(Servo(0.08), applied=Servo(0.03))
    assert np.allclose(found, (1.0 + 0.03 * S) / (1.0 + 0.08 * S))


@pytest.mark.parametrize("late", [0.0, 0.05])
def test_the_gain_of_the_rate_is_the_derivative_by_the_lateness(late):
    def model(by: float) -> ServoModel:
        return ServoModel(np.array([late + by]), np.array([4e-4]), np.array([1e-6]))

    none, step = ServoModel(np.zeros(1), np.zeros(1), np.zeros(1)), 1e-5
    h = [1.0 + S * lateness(model(by), none, OMEGA)[:, 0] for by in (-step, 0.0, step)]
    slope = (h[2] - h[0]) / (2.0 * step)
    assert np.allclose(slope, rate_gain(model(0.0), OMEGA)[:, 0] * S * h[1], rtol=1e-6)
