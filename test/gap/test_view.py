"""Measured against predicted: nothing but the sensors' noise is left where the simulator is the aircraft."""

from dataclasses import replace

import numpy as np

from sysid_node.gap import view
from sysid_node.gap.view import kinematic


def test_only_noise_is_left_of_the_same_aircraft(plain_view) -> None:
    residual = np.abs(plain_view.residual(plain_view.simulator.neutral())[:, 1:]) ** 2
    ratio = residual.mean(axis=0).sum(axis=0) / plain_view.noise[1:].sum(axis=0)
    assert (ratio[[0, 1, 2, 4]] < 3.0).all() and (ratio < 8.0).all(), ratio


def test_slopes_agree_with_differences(plain_view) -> None:
    names, neutral = plain_view.simulator.names, plain_view.simulator.neutral()
    index = names.index("derivative_error.Cm_alpha")
    step = np.zeros_like(neutral)
    step[index] = 1e-4
    numeric = (plain_view.predicted(neutral + step) - plain_view.predicted(neutral - step)) / 2e-4
    slopes = plain_view.slopes(neutral, [index])[..., 0]
    np.testing.assert_allclose(slopes, numeric, atol=1e-6 * np.abs(numeric).max())


def test_kinematics_depend_on_no_other_entries_than_those_named(plain_view) -> None:
    simulator = plain_view.simulator
    entries = np.setdiff1d(np.arange(len(simulator.names)), kinematic(simulator.layout))
    somewhere = simulator.neutral() + 0.1 * np.random.default_rng(0).random(len(simulator.names))
    changed = somewhere.copy()
    changed[entries] += 0.01
    np.testing.assert_array_equal(
        plain_view.predicted_series(changed)[:, 6:], plain_view.predicted_series(somewhere)[:, 6:]
    )


def test_the_flow_is_moved_by_no_other_entries_than_those_named(plain_view) -> None:
    """Slopes in a flow that is known are those of everything together; truth: JAX, through the flow."""
    simulator = plain_view.simulator
    point = simulator.neutral() + 0.01 * np.random.default_rng(0).random(len(simulator.names))
    entries = np.setdiff1d(np.arange(len(simulator.names)), kinematic(simulator.layout)).tolist()
    assert len(entries) > 60
    for some in (entries[first : first + 3] for first in range(0, len(entries), 3)):
        through, known = (plain_view._slopes_along(e, point, some) for e in (view._forces, view._forces_in))
        np.testing.assert_allclose(known, through, atol=1e-12 * max(np.abs(through).max(), 1e-3))


def test_what_is_kept_along_with_slopes_is_what_is_predicted(plain_view) -> None:
    names, point = plain_view.simulator.names, plain_view.simulator.neutral()
    point[names.index("cg_shift.x")] = 0.02
    fresh = replace(plain_view)
    fresh.slopes(point, [names.index("imu_bias.q"), names.index("actuator_lag.time_constant")])
    expected = plain_view.windows.transform(plain_view.predicted_series(point))
    np.testing.assert_allclose(fresh.predicted(point), expected, atol=1e-12 * np.abs(expected).max())
