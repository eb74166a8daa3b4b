"""The structural mode's response: the exact solution of its equation, and its stability."""

import jax.numpy as jnp
import numpy as np
import pytest
from plain import make_aircraft
from scipy.signal import lsim
from simulated_signals import signals_from, smooth_inputs

from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.prediction.coefficients import predict_coefficients
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
    assert (error < 1e-4 * np.abs(truth).max(axis=0)).all()


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
    signals = signals_from(slow.rollout(slow.neutral(), trim.initial, inputs), inputs.commands)
    without, expected = (np.abs(predict_coefficients(slow, t, signals)).max() for t in (slow.neutral(), theta))
    assert expected < 3.0 * without
