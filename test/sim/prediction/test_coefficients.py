"""Both views of the chain against each other: predictions from a rollout's signals equal what the rollout shows."""

import numpy as np
import pytest
from simulated_signals import SAMPLES, coefficient_slopes, predicted_coefficients, signals_from, smooth_inputs

from sysid_node.dynamics.vector import Vector
from sysid_node.sim import EFFECTS, trim_flight
from sysid_node.sim.prediction.accelerations import Accelerations
from sysid_node.sim.prediction.coefficients import coefficients

INNER = slice(40, -40)  # without the ends, where shifts and differences lack neighbours


def shown(simulator, flight, signals):
    """Coefficients by the aircraft file of what the instruments showed, rates differentiated."""
    outputs = np.asarray(flight.outputs)
    turning = np.zeros((len(outputs), 3))
    rates = outputs[:, 3:6]
    turning[2:-2] = (8 * (rates[3:-1] - rates[1:-3]) - (rates[4:] - rates[:-4])) * simulator.rate / 12
    seen = Accelerations(Vector(*outputs[:, :3].T), Vector(*turning.T))
    return np.stack(coefficients(simulator.model, signals, seen), axis=1)


#: Effects that do not change a prediction, and why.
NOT_SEEN = {
    "steady_wind": "no instrument on board measures it",
    "turbulence": "the vanes measure it",
    "gust": "the vanes measure it",
    "sensor_noise": "it is in the signals",
}


@pytest.mark.slow
@pytest.mark.parametrize("effect", [name for name in EFFECTS if name not in NOT_SEEN])
def test_prediction_expects_what_the_rollout_shows(fast, effect):
    theta = fast.neutral()
    for i, (name, parameter) in enumerate(fast.parameters):
        if name == effect and parameter.switch:
            theta[i] = np.clip(parameter.neutral + 0.5 * fast.scales[i], parameter.lower, parameter.upper)
        if name == effect == "actuator_rate_limit":
            theta[i] = 1.0 / 0.15  # slower than what is commanded
    theta[fast.names.index("stall_separation.alpha_star")] = 0.12  # within what is flown
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    flight = fast.rollout(theta, trim.initial, inputs)
    signals = signals_from(flight, inputs.commands, fast.step)
    measured = shown(fast, flight, signals)[INNER]
    expected = predicted_coefficients(fast, theta, signals)[INNER]
    neutral = predicted_coefficients(fast, fast.neutral(), signals)[INNER]
    error, effect_size = np.abs(expected - measured).max(axis=0), np.abs(neutral - measured).max(axis=0)
    scale = np.abs(measured).max(axis=0)
    share = 0.2 if effect == "structural_mode" else 0.05  # the mode's pitch rate also changes the probe's correction
    assert (error < share * effect_size + 4e-4 * scale).all(), f"{error / scale} of {effect_size / scale}"
    assert (effect_size > 2e-3 * scale).any()  # the effect shows


def test_neutral_prediction_is_the_true_coefficients(fast):
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    flight = fast.rollout(fast.neutral(), trim.initial, inputs)
    expected = predicted_coefficients(fast, fast.neutral(), signals_from(flight, inputs.commands, fast.step))
    np.testing.assert_allclose(expected, flight.coefficients, atol=1e-10)


def test_turbulence_does_no_harm(fast):
    random = np.random.default_rng(1)
    gusts = np.zeros((SAMPLES, 6))
    gusts[:, :3] = 0.05 * random.standard_normal((SAMPLES, 3)).cumsum(axis=0)
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)._replace(gusts=gusts)
    flight = fast.rollout(fast.neutral(), trim.initial, inputs)
    expected = predicted_coefficients(fast, fast.neutral(), signals_from(flight, inputs.commands, fast.step))
    np.testing.assert_allclose(expected, flight.coefficients, atol=1e-10)


@pytest.mark.slow
def test_slopes_agree_with_finite_differences(fast):
    trim = trim_flight(fast)
    inputs = smooth_inputs(fast, trim)
    theta = fast.neutral()
    for i, (_, parameter) in enumerate(fast.parameters):
        theta[i] = np.clip(parameter.neutral + 0.313 * fast.scales[i], parameter.lower, parameter.upper)
    signals = signals_from(fast.rollout(fast.neutral(), trim.initial, inputs), inputs.commands, fast.step)
    slopes = coefficient_slopes(fast, theta, signals)
    for i, name in enumerate(fast.names):
        h = np.zeros(len(theta))
        h[i] = 1e-5 * fast.scales[i]
        up, down = (predicted_coefficients(fast, theta + s * h, signals) for s in (1, -1))
        numeric = (up - down) / (2 * h[i])
        size = np.abs(numeric).max()
        assert np.abs(slopes[:, :, i] - numeric).max() <= 1e-3 * size + 1e-9, name
