"""The structural mode's response: the exact solution of its equation, and its stability."""

import jax.numpy as jnp
import numpy as np
import pytest
from plain import make_aircraft
from scipy.signal import lsim
from simulated_signals import predicted_coefficients, signals_from, smooth_inputs

from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import OUTPUTS
from sysid_node.sim.prediction.structural_response import mode_response


def test_response_is_the_exact_one(fast):
    """Truth: the matrix exponential for a force linear between samples (SciPy's lsim)."""
    theta = fast.neutral()
    frequency, damping = (theta[fast.names.index(f"structural_mode.{name}")] for name in ("frequency", "damping"))
    chain = Chain.of(fast.layout, fast.model, jnp.asarray(theta), jnp.asarray(fast.step), jnp.zeros(()))
    time = np.arange(401) * fast.step
    load = -9.8 + 3.0 * np.sin(20.0 * time) * (time > 0.5)
    w = 2.0 * np.pi * frequency
    system = ([[0.0, 1.0], [-w * w, -2.0 * damping * w]], [[0.0], [1.0]], np.eye(2), np.zeros((2, 1)))
    _, _, truth = lsim(system, load, time, X0=[load[0] / w**2, 0.0])
    error = np.abs(np.asarray(mode_response(chain, jnp.asarray(load))) - truth).max(axis=0)
    assert (error < 1e-10 * np.abs(truth).max(axis=0)).all()


def test_a_mode_faster_than_the_samples_stays_bounded():
    """Four cycles between two samples: its response is no larger than that of an undamped mode to a step."""
    slow = Simulator(make_aircraft(), 10.0)
    theta = slow.neutral()
    for name, value in {"gain": 1.0, "frequency": 40.0}.items():
        theta[slow.names.index(f"structural_mode.{name}")] = value
    trim = trim_flight(slow)
    plain, shaken = (slow.rollout(t, trim.initial, smooth_inputs(slow, trim)).outputs for t in (slow.neutral(), theta))
    felt = np.asarray(shaken - plain)[:, OUTPUTS.index("az")]
    assert 0.0 < np.abs(felt).max() < 2.0 * np.ptp(np.asarray(plain)[:, OUTPUTS.index("az")])


@pytest.mark.parametrize("slope", [-20.0, 20.0])
@pytest.mark.parametrize("frequency", [2.0, 8.0, 40.0])
def test_response_stays_bounded(slope, frequency):
    """With the largest pitch rate of the mode, and with the steps of integration at the diagnosis' rate."""
    slow = Simulator(make_aircraft(), 50.0)
    theta = slow.neutral()
    for name, value in {"gain": 5.0, "slope": slope, "frequency": frequency, "damping": 0.05}.items():
        theta[slow.names.index(f"structural_mode.{name}")] = value
    trim = trim_flight(slow)
    inputs = smooth_inputs(slow, trim)
    signals = signals_from(slow.rollout(slow.neutral(), trim.initial, inputs), inputs.commands, slow.step)
    without, expected = (np.abs(predicted_coefficients(slow, t, signals)).max() for t in (slow.neutral(), theta))
    assert expected < 3.0 * without
