"""States carried along the measured signals: those of a rollout with the same commands."""

from functools import partial

import jax.numpy as jnp
import numpy as np
from simulated_signals import signals_from, smooth_inputs

from sysid_node.sim import trim_flight
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.prediction.active_effects import effect_acts
from sysid_node.sim.prediction.carried_states import carried_states
from sysid_node.sim.prediction.true_motion import true_motion


def test_actuators_and_motor_are_those_of_a_rollout(fast):
    """Truth: the true surfaces and thrust of a rollout with lag, backlash, rate limit and motor lag."""
    theta = fast.vector(
        {
            "actuator_lag": {"time_constant": 0.08},
            "actuator_backlash": {"elevator": 0.01},
            "actuator_rate_limit": {"rate": 0.15},
            "motor_lag": {"time_constant": 0.3},
        }
    )
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    flight = fast.rollout(theta, trim.initial, inputs)
    chain = Chain.of(fast.layout, fast.model, jnp.asarray(theta), jnp.asarray(fast.step), jnp.zeros(()))
    motion = true_motion(chain, signals_from(flight, inputs.commands))
    states = carried_states(chain, motion, partial(effect_acts, fast.layout, jnp.asarray(theta != fast.neutral())))
    np.testing.assert_allclose(np.column_stack([states.actuators, states.motor]), flight.surfaces, atol=1e-12)
    assert np.ptp(np.asarray(states.actuators), axis=0).min() > 0.01
    np.testing.assert_array_equal(states.separation, 1.0)  # attached where the stall does not act
