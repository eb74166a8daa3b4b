"""Predicted accelerations where effects are left out."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from simulated_signals import signals_from, smooth_inputs

from sysid_node.sim import trim_flight
from sysid_node.sim.prediction.accelerations import predict_accelerations


@pytest.mark.slow
@pytest.mark.parametrize("effect", [None, "actuator_lag", "stall_separation", "structural_mode"])
def test_effects_without_acting_parameters_may_be_left_out(fast, effect):
    """Truth: the same with every effect evaluated."""
    theta = fast.neutral()
    for i, (name, parameter) in enumerate(fast.parameters):
        if name == effect and parameter.switch:
            theta[i] += 0.5 * parameter.scale
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    signals = signals_from(fast.rollout(fast.neutral(), trim.initial, inputs), inputs.commands, fast.step)
    expected = partial(
        predict_accelerations, fast.layout, fast.model, jnp.asarray(theta), signals, jnp.asarray(fast.step)
    )
    whole, part = jax.jit(expected)(), jax.jit(expected)(theta != fast.neutral())
    for truth, found in zip(jax.tree.leaves(whole), jax.tree.leaves(part), strict=True):
        np.testing.assert_allclose(found, truth, rtol=0, atol=1e-12 * np.abs(truth).max())
