"""Integration and its Jacobian, against closed forms and finite differences."""

import dataclasses

import numpy as np
from made_models import SHORT_PERIOD, flown, short_period_model
from scipy.linalg import expm

from sysid_node.batch.likelihood import rollout
from sysid_node.batch.models.manoeuvre import ManoeuvreData, block_means

MODEL = short_period_model()
SYSTEM = np.array([[SHORT_PERIOD["Za"], 1.0], [SHORT_PERIOD["Ma"], SHORT_PERIOD["Mq"]]])


def free_motion(step):
    """Outputs over one second from an initial disturbance, and the exact ones (matrix exponential)."""
    time = np.arange(0.0, 1.0 + step / 2, step)
    manoeuvre = ManoeuvreData(time, np.zeros((time.size, 1)), np.zeros((time.size, 3)), np.array([0.1, 0.0]))
    exact = np.array([expm(SYSTEM * t) @ manoeuvre.initial_state for t in time])
    return rollout.outputs(MODEL, manoeuvre, MODEL.start)[:, :2], exact


def test_the_error_falls_with_the_fourth_power_of_the_step():
    steps = np.array([0.04, 0.02, 0.01, 0.005])
    errors = [np.abs(np.subtract(*free_motion(step))).max() for step in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 3.8 < order < 4.2


def test_uneven_samples_are_integrated_at_their_own_times():
    rng = np.random.default_rng(3)
    time = np.concatenate([[0.0], np.cumsum(rng.uniform(0.002, 0.015, 150))])
    manoeuvre = ManoeuvreData(time, np.zeros((time.size, 1)), np.zeros((time.size, 3)), np.array([0.1, 0.0]))
    exact = np.array([expm(SYSTEM * t) @ manoeuvre.initial_state for t in time])
    np.testing.assert_allclose(rollout.outputs(MODEL, manoeuvre, MODEL.start)[:, :2], exact, atol=2e-6)


def test_sensitivities_agree_with_finite_differences():
    manoeuvre, theta = flown(MODEL, initial=(0.02, 0.1)), MODEL.start
    found = rollout.sensitivities(MODEL, manoeuvre, theta, manoeuvre.initial_state, (0, 2, 4), (1,))
    for column, index in enumerate((0, 2, 4)):
        step = 1e-5 * abs(theta[index])
        up, down = theta.copy(), theta.copy()
        up[index] += step
        down[index] -= step
        slope = (rollout.outputs(MODEL, manoeuvre, up) - rollout.outputs(MODEL, manoeuvre, down)) / (2.0 * step)
        np.testing.assert_allclose(found[:, :, column], slope, rtol=1e-6, atol=1e-8)
    x0 = manoeuvre.initial_state
    up, down = (rollout.outputs(MODEL, manoeuvre, theta, x0 + np.array([0.0, step])) for step in (1e-5, -1e-5))
    np.testing.assert_allclose(found[:, :, 3], (up - down) / 2e-5, rtol=1e-6, atol=1e-8)


def test_averaged_outputs_are_the_averages():
    whole = flown(MODEL, rate=100.0)
    averaged = dataclasses.replace(whole, outputs=block_means(whole.outputs, 3), every=3)
    expected = block_means(rollout.outputs(MODEL, whole, MODEL.start), 3)
    np.testing.assert_allclose(rollout.outputs(MODEL, averaged, MODEL.start), expected, atol=1e-12)
    slopes = rollout.sensitivities(MODEL, whole, MODEL.start, whole.initial_state, (4,))
    found = rollout.sensitivities(MODEL, averaged, MODEL.start, whole.initial_state, (4,))
    np.testing.assert_allclose(found, block_means(slopes, 3), atol=1e-12)
    np.testing.assert_allclose(averaged.output_time[:2], [0.01, 0.04])
