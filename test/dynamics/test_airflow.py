"""Airspeed and flow angles. Truth: their definitions, finite differences, one form by the other."""

import numpy as np
import pytest

from sysid_node.dynamics.airflow import flow_angles, flow_rates, stability_axes, velocity_of, wind_axes_rates
from sysid_node.dynamics.rigid_body import velocity_rate
from sysid_node.dynamics.vector import Vector

FLOW = (18.0, 0.12, -0.2)


def test_flow_angles_by_definition() -> None:
    u, v, w = velocity = velocity_of(FLOW, np)
    assert np.sqrt(u * u + v * v + w * w) == pytest.approx(18.0)
    assert np.arctan(w / u) == pytest.approx(0.12)
    assert np.arcsin(v / 18.0) == pytest.approx(-0.2)
    np.testing.assert_allclose(flow_angles(velocity, np), FLOW, rtol=1e-14)
    np.testing.assert_allclose(stability_axes(velocity, np), (np.cos(0.12), np.sin(0.12)))


def test_rates_of_the_flow_against_finite_differences() -> None:
    velocity, rate, h = np.array(velocity_of(FLOW, np)), np.array([0.4, -3.0, 5.0]), 1e-5
    before, after = (np.array(flow_angles(tuple(velocity + sign * h * rate), np)) for sign in (-1.0, 1.0))
    np.testing.assert_allclose(flow_rates(tuple(velocity), tuple(rate), np), (after - before) / (2.0 * h), rtol=1e-8)


def test_wind_axes_equations_are_the_body_axes_equations() -> None:
    """In states V, alpha, beta and in states u, v, w (Stevens, Lewis & Johnson, sec. 2.5)."""
    velocity, rates, force = velocity_of(FLOW, np), Vector(0.5, -0.3, 0.8), Vector(1.0, -0.6, -11.0)
    down = Vector(-0.3, 0.4, np.sqrt(0.75))
    expected = flow_rates(velocity, velocity_rate(force, down, rates, velocity), np)
    acceleration = force.plus(down.times(9.80665))
    np.testing.assert_allclose(wind_axes_rates(FLOW, rates, acceleration, np), expected, rtol=1e-13)
