"""The response of a servo in the frequency domain against exact responses."""

import numpy as np
import pytest

from sysid_node.flight.servos import Servo
from sysid_node.online.systematic.servo_model import (
    ServoModel,
    expected_third,
    lateness,
    of_servo,
    rate_gain,
    third_slopes,
)

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
    """A lag of 40 ms with a delay of 20 ms that is moved to be a lag of 50 ms with it. Truth: their product."""
    before, after = of_servo(Servo(0.04, delay=0.02)), of_servo(Servo(0.05, delay=0.02))
    stated = ServoModel(*(np.array([value]) for value in before))
    moved = stated.moved(np.array([after[0] - before[0]]), np.array([after[1] - before[1]]))
    assert np.allclose(moved.third - stated.third, after[2] - before[2], atol=0.005 * after[0] ** 3)
    back = moved.moved(stated.lateness - moved.lateness, stated.curvature - moved.curvature)
    assert back.third == pytest.approx(stated.third)


@pytest.mark.parametrize(
    ("lag", "delay", "damping"), [(0.05, 0.0, 0.0), (0.05, 0.02, 0.0), (0.02, 0.04, 0.0), (0.03, 0.02, 0.7)]
)
def test_the_third_coefficient_that_is_expected_is_that_of_ordinary_servos(lag, delay, damping):
    """Within the 1 sigma that is stated for it, 0.05 L^3. Truth: lags with delays, multiplied out."""
    late, curved, third = of_servo(Servo(lag, delay=delay, damping=damping))
    assert expected_third(np.array([late]), np.array([curved])) == pytest.approx(third, abs=0.05 * late**3)


@pytest.mark.parametrize("late", [0.005, 0.06])
def test_the_slopes_of_the_third_coefficient_are_its_differences(late):
    at, step = (np.array([late]), np.array([0.001])), 1e-7
    by_lateness, by_curvature = third_slopes(*at)
    assert by_lateness == pytest.approx((expected_third(at[0] + step, at[1]) - expected_third(*at)) / step, rel=1e-4)
    assert by_curvature == pytest.approx((expected_third(at[0], at[1] + step) - expected_third(*at)) / step, rel=1e-4)


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
