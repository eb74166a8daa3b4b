"""Margins and stability against textbook loops whose answers are known in closed form."""

import numpy as np
import pytest

from sysid_node.control.design import margins as m
from sysid_node.control.design.plant import behind_actuators
from sysid_node.dynamics.linear_model import LinearModel

INTEGRATOR = LinearModel(np.zeros((1, 1)), np.ones((1, 1)))


@pytest.mark.parametrize(("gain", "delay"), [(1.0, 0.1), (4.0, 0.05), (10.0, 0.1)])
def test_integrator_with_delay(gain: float, delay: float) -> None:
    """k exp(-sT) / s crosses -180 deg at pi / 2T with a gain of 2 k T / pi, and gain 1 at k, pi/2 - k T away."""
    found = m.margins(INTEGRATOR, np.array([[gain]]), delay)
    assert float(found.gain) == pytest.approx(np.pi / (2.0 * gain * delay), rel=0.01)
    assert float(found.phase) == pytest.approx(np.pi / 2.0 - gain * delay, abs=0.01)
    assert bool(found.stable)


@pytest.mark.parametrize(("gain", "stable"), [(15.0, True), (16.5, False)])
def test_stability_turns_where_theory_says(gain: float, stable: bool) -> None:
    """The integrator behind a delay of 0.1 s is stable below a gain of pi / 0.2 = 15.7."""
    assert bool(m.stable(INTEGRATOR, np.array([[gain]]), 0.1)) is stable


def test_margin_downwards_of_an_unstable_plant() -> None:
    """k / (s - 1) is stable above k = 1: from 4 its gain may fall by 4."""
    unstable = LinearModel(np.ones((1, 1)), np.ones((1, 1)))
    loop = m.one_at_a_time(m.transfer(unstable, np.array([[4.0]]), m.OMEGA))
    assert abs(loop[0, 0]) == pytest.approx(4.0, rel=0.01)  # at its lowest frequency the loop is -4
    assert bool(m.stable(unstable, np.array([[4.0]]), 0.0))
    assert not bool(m.stable(unstable, np.array([[0.9]]), 0.0))


def test_transfer_is_the_direct_solution() -> None:
    rng = np.random.default_rng(1)
    A, B, K = rng.normal(size=(5, 5)), rng.normal(size=(5, 2)), rng.normal(size=(2, 5))
    found = m.transfer(LinearModel(A, B), K, m.OMEGA)
    expected = [K @ np.linalg.solve(1j * w * np.eye(5) - A, B) for w in m.OMEGA]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_one_loop_at_a_time_closes_the_other() -> None:
    """The loop at input 1 with input 2 closed, from the plant with that feedback built in."""
    rng = np.random.default_rng(2)
    A, B, K = rng.normal(size=(4, 4)) - 3.0 * np.eye(4), rng.normal(size=(4, 2)), rng.normal(size=(2, 4))
    found = m.one_at_a_time(m.transfer(LinearModel(A, B), K, m.OMEGA))[:, 0]
    closed = LinearModel(A - B[:, 1:] @ K[1:], B[:, :1])
    np.testing.assert_allclose(found, m.transfer(closed, K[:1], m.OMEGA)[:, 0, 0], rtol=1e-8)


def test_a_stack_of_plants_is_each_of_them() -> None:
    rng = np.random.default_rng(3)
    A, B, K = rng.normal(size=(6, 3, 3)) - 2.0 * np.eye(3), rng.normal(size=(6, 3, 1)), rng.normal(size=(1, 3))
    plants = behind_actuators(LinearModel(A, B), 0.05)
    gains = np.hstack([K, np.zeros((1, 1))])
    together = m.margins(plants, gains, 0.02)
    for i in range(6):
        one = m.margins(LinearModel(plants.A[i], plants.B[i]), gains, 0.02)
        assert float(one.phase) == pytest.approx(float(together.phase[i]))
        assert bool(one.stable) == bool(together.stable[i])
