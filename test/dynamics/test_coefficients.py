"""Coefficients, forces and moments. Truth: the definitions, by hand, and each function's inverse."""

import numpy as np
import pytest

from sysid_node.aircraft.model import Throttle
from sysid_node.dynamics.coefficients import Coefficients, linear_coefficient, regressors, with_polar
from sysid_node.dynamics.forces import coefficients_of, force_and_moment, lift_and_drag, thrust_axes, thrust_line
from sysid_node.dynamics.vector import Vector


def test_regressors_by_hand() -> None:
    found = regressors((20.0, 0.1, -0.05), Vector(0.4, 0.2, -0.1), 2.0, 0.3, 16.0)
    expected = {"0": 1.0, "alpha": 0.1, "beta": -0.05, "p": 0.02, "q": 0.0015, "r": -0.005, "V": 1.25}
    assert found == pytest.approx(expected)


def test_a_coefficient_is_linear_in_its_derivatives_and_drag_may_be_a_polar() -> None:
    x = regressors((20.0, 0.1, 0.0), Vector(0.0, 0.2, 0.0), 2.0, 0.3, 16.0)
    lift = linear_coefficient([(0.2, "0"), (4.0, "alpha"), (5.0, "q")], x)
    assert lift == pytest.approx(0.2 + 0.4 + 0.0075)
    assert linear_coefficient([(0.03, "0"), (0.05, "k")], with_polar(x, lift)) == pytest.approx(0.03 + 0.05 * lift**2)
    np.testing.assert_array_equal(linear_coefficient([], x, np.zeros(3)), np.zeros(3))


def test_lift_acts_across_the_flow_and_drag_along_it() -> None:
    alpha = 0.2
    axes = np.cos(alpha), np.sin(alpha)
    force, _ = force_and_moment(Coefficients(1.0, 0.1, 0.0, 0.0, 0.0, 0.0), axes, 10.0, 2.0, 0.3)
    flow = np.array([np.cos(alpha), np.sin(alpha)])  # forward and down
    assert np.array([force.x, force.z]) @ flow == pytest.approx(-1.0)
    assert np.array([force.x, force.z]) @ [-flow[1], flow[0]] == pytest.approx(-10.0)
    np.testing.assert_allclose(lift_and_drag(force.x, force.z, *axes), (10.0, 1.0))


def test_coefficients_of_their_own_forces() -> None:
    c = Coefficients(0.8, 0.06, -0.1, 0.02, -0.03, 0.01)
    axes = np.cos(0.15), np.sin(0.15)
    force, moment = force_and_moment(c, axes, 120.0, 2.0, 0.3)
    np.testing.assert_allclose(coefficients_of(force, moment, axes, 120.0, 2.0, 0.3), c, rtol=1e-13)
    np.testing.assert_allclose(moment, (120.0 * 2.0 * 0.02, 120.0 * 0.3 * -0.03, 120.0 * 2.0 * 0.01))


def test_thrust_inclined_upwards_carries_weight() -> None:
    forward, down = thrust_axes(0.1, np)
    assert (forward, down) == pytest.approx((np.cos(0.1), -np.sin(0.1)))
    assert thrust_line(Throttle("throttle", 30.0, inclination=0.1, arm=0.02)) == (0.1, 0.02)
    assert thrust_line(None) == (0.0, 0.0)
