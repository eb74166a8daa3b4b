"""Filter error's problem: its sensitivities against finite differences, and its noises."""

import numpy as np
import pytest
from made_models import NOISE, flown, noisy, short_period_model, with_outputs

from sysid_node.batch.likelihood.filter_error_problem import FilterErrorProblem, noise_names
from sysid_node.batch.likelihood.unknowns import Unknowns


@pytest.fixture(scope="module")
def problem():
    model = short_period_model()
    manoeuvre = noisy(flown(model), np.random.default_rng(1))
    return FilterErrorProblem(Unknowns.of(model, [manoeuvre], ("q",), ("az",)))


def test_the_noises_stand_last_in_the_vector(problem):
    names = noise_names(problem.unknowns.model)
    assert names == ["process_alpha", "process_q", "sensor_alpha", "sensor_q", "sensor_az"]
    assert problem.start().size == problem.unknowns.size + len(names)


def test_sensor_noise_starts_at_its_level_where_nothing_moves():
    """Second differences of white noise have six times its variance."""
    model = short_period_model()
    outputs = NOISE * np.random.default_rng(2).normal(size=(500, 3))
    still = FilterErrorProblem(Unknowns.of(model, [with_outputs(flown(model), outputs)], (), ()))
    np.testing.assert_allclose(np.exp(still.start()[-3:]), NOISE, rtol=0.1)


@pytest.mark.slow
def test_sensitivities_are_the_derivatives_of_the_predictions(problem):
    z = problem.start()
    (block,) = problem.sensitivities(z)
    for k in range(z.size):
        step = np.eye(z.size)[k] * 1e-5 * (1.0 + abs(z[k]))
        (above,), (below,) = problem.responses(z + step), problem.responses(z - step)
        slope = (above.modelled - below.modelled) / (2.0 * step[k])
        np.testing.assert_allclose(block[:, :, k], slope, rtol=1e-4, atol=1e-5 * np.abs(slope).max() + 1e-9)
