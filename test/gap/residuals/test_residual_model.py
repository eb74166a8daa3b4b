"""Measured against predicted: nothing but the sensors' noise is left where the simulator is the aircraft."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from sysid_node.gap.residuals.predictions import all_channels, kinematic_parameters


def test_only_noise_is_left_of_the_same_aircraft(plain_model) -> None:
    residual = np.abs(plain_model.residual(plain_model.simulator.neutral())[:, 1:]) ** 2
    ratio = residual.mean(axis=0).sum(axis=0) / plain_model.noise[1:].sum(axis=0)
    assert (ratio[[0, 1, 2, 4]] < 3.0).all() and (ratio < 8.0).all(), ratio


def test_slopes_agree_with_differences(plain_model) -> None:
    names, neutral = plain_model.simulator.names, plain_model.simulator.neutral()
    index = names.index("derivative_error.Cm_alpha")
    step = np.zeros_like(neutral)
    step[index] = 1e-4
    numeric = (plain_model.predicted(neutral + step) - plain_model.predicted(neutral - step)) / 2e-4
    slopes = plain_model.slopes(neutral, [index])[..., 0]
    np.testing.assert_allclose(slopes, numeric, atol=1e-6 * np.abs(numeric).max())


def test_kinematics_depend_on_no_other_entries_than_those_named(plain_model) -> None:
    simulator = plain_model.simulator
    entries = np.setdiff1d(np.arange(len(simulator.names)), kinematic_parameters(simulator.layout))
    somewhere = simulator.neutral() + 0.1 * np.random.default_rng(0).random(len(simulator.names))
    changed = somewhere.copy()
    changed[entries] += 0.01
    np.testing.assert_array_equal(
        plain_model.predicted_series(changed)[:, 6:], plain_model.predicted_series(somewhere)[:, 6:]
    )


@pytest.mark.slow
def test_slopes_of_all_parameters_are_those_of_the_whole_prediction(plain_model) -> None:
    """The flow is held for what does not move it, and slopes come in batches; truth: JAX, of everything at once."""
    simulator = plain_model.simulator
    random = np.random.default_rng(0)
    point = simulator.neutral() + 0.01 * random.random(len(simulator.names))
    acting = np.ones(len(point), bool)

    @jax.jit
    def along(direction: jax.Array) -> list[jax.Array]:
        def channels(theta: jax.Array) -> list[jax.Array]:
            return list(all_channels(simulator.layout, simulator.model, theta, acting, plain_model.inputs, None))

        return jax.jvp(channels, (point,), (direction,))[1]

    entries = list(range(len(point)))
    assert len(entries) > 80
    direction = random.normal(size=len(point)) * simulator.scales
    found = plain_model.slopes(point, entries) @ direction
    series = np.stack(along(direction), axis=1)[: len(plain_model.record)]
    truth = plain_model.windows.transform(series)
    np.testing.assert_allclose(found, truth, atol=1e-11 * np.abs(truth).max())


def test_what_is_kept_along_with_slopes_is_what_is_predicted(plain_model) -> None:
    names, point = plain_model.simulator.names, plain_model.simulator.neutral()
    point[names.index("cg_shift.x")] = 0.02
    fresh = replace(plain_model)
    fresh.slopes(point, [names.index("imu_bias.q"), names.index("actuator_lag.time_constant")])
    expected = plain_model.windows.transform(plain_model.predicted_series(point))
    np.testing.assert_allclose(fresh.predicted(point), expected, atol=1e-12 * np.abs(expected).max())
