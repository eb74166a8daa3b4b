"""States carried along the measured signals: those of a rollout with the same commands."""

from functools import partial

import jax.numpy as jnp
import numpy as np
import pytest
from plain import make_aircraft
from simulated_signals import signals_from, smooth_inputs

from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.prediction.active_effects import effect_acts
from sysid_node.sim.prediction.carried_states import actuators_of, carried_states
from sysid_node.sim.prediction.true_motion import true_motion
from sysid_node.sim.signals.low_pass import SPREAD


@pytest.mark.slow
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
    motion = true_motion(chain, signals_from(flight, inputs.commands, fast.step))
    states = carried_states(chain, motion, partial(effect_acts, fast.layout, jnp.asarray(theta != fast.neutral())))
    np.testing.assert_allclose(np.column_stack([states.actuators, states.motor]), flight.surfaces, atol=1e-12)
    assert np.ptp(np.asarray(states.actuators), axis=0).min() > 0.01
    np.testing.assert_array_equal(states.separation, 1.0)  # attached where the stall does not act


@pytest.mark.slow
def test_a_rate_limit_sees_commands_before_the_low_pass():
    """Truth: steps of 0.2 rad at 0.4 rad/s by a loop at 2 kHz, then the Gaussian. A smoothed step leads by 24 ms."""
    simulator, fine = Simulator(make_aircraft(), 50.0), 2000
    theta = jnp.asarray(simulator.vector({"actuator_rate_limit": {"elevator": 0.4}}))
    chain = Chain.of(simulator.layout, simulator.model, theta, jnp.asarray(simulator.step), jnp.zeros(()))
    time = np.arange(4 * fine) / fine
    command, position = 0.2 * ((time // 1.0) % 2 == 1), np.zeros(time.size)
    for k in range(1, time.size):
        position[k] = position[k - 1] + np.clip(command[k] - position[k - 1], -0.4 / fine, 0.4 / fine)
    offsets = np.arange(-200, 201) * 50.0 / fine
    taps = np.exp(-0.5 * (offsets / SPREAD) ** 2)
    truth = np.convolve(np.pad(position, 200, mode="edge"), taps / taps.sum(), mode="valid")
    recorded = np.zeros((200, 4, 3))
    recorded[:, :, 0] = command[:: fine // 200].reshape(200, 4)
    moved = np.asarray(actuators_of(chain, jnp.asarray(recorded)))
    inner = slice(10, -10)
    np.testing.assert_allclose(moved[inner, 0], truth[:: fine // 50][inner], atol=0.4 * 0.006)
    np.testing.assert_array_equal(moved[:, 1:], 0.0)
