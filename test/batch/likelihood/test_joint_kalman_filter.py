"""Filtering state and parameters together: several manoeuvres, one-step predictions, and what is refused."""

import numpy as np
import pytest
from made_models import NOISE, SHORT_PERIOD, flown, noisy, short_period_model, with_outputs

from sysid_node.batch.likelihood.joint_kalman_filter import FilterNoise, filter_along, one_step_predictions
from sysid_node.batch.methods.extended_kalman_filter import EXTENDED
from sysid_node.batch.methods.unscented_kalman_filter import UNSCENTED
from sysid_node.errors import InputError

TOLERANCES = [0.3 * abs(value) for value in SHORT_PERIOD.values()]
TOLD = FilterNoise(np.zeros(2), NOISE**2, np.array([1e-4, 1e-4, *TOLERANCES]))
STEPS = pytest.mark.parametrize("steps", [EXTENDED, UNSCENTED], ids=["extended", "unscented"])


@STEPS
def test_a_second_manoeuvre_goes_on_where_the_first_has_ended(steps):
    start = short_period_model({name: 0.8 * value for name, value in SHORT_PERIOD.items()})
    rng = np.random.default_rng(2)
    first, second = (noisy(flown(short_period_model()), rng) for _ in range(2))
    alone = filter_along(start, [first], TOLD, steps)
    both = filter_along(start, [first, second], TOLD, steps)
    np.testing.assert_allclose(both.values[: len(first)], alone.values, rtol=1e-9)
    assert (np.diff(both.time) >= 0.0).all()
    # two flights of the same length hold twice the information
    np.testing.assert_allclose(both.errors[-1], alone.errors[-1] / np.sqrt(2.0), rtol=0.1)
    np.testing.assert_allclose(np.sqrt(np.diag(both.covariance)), both.errors[-1], rtol=1e-6)


@STEPS
def test_one_step_predictions_with_the_true_parameters_leave_the_sensors_noise(steps):
    model, clean = short_period_model(), flown(short_period_model())
    (exact,) = one_step_predictions(model, [clean], TOLD, steps)
    np.testing.assert_allclose(exact.modelled, clean.outputs, atol=1e-9)
    (response,) = one_step_predictions(model, [noisy(clean, np.random.default_rng(4))], TOLD, steps)
    np.testing.assert_allclose(response.residuals.std(axis=0), NOISE, rtol=0.15)


def test_a_filter_that_breaks_down_is_refused():
    nothing = FilterNoise(np.zeros(2), NOISE**2, np.zeros(7))  # no sigma points about a covariance of zero
    with pytest.raises(InputError, match=r"the Kalman filter diverged at 0\.00 s"):
        filter_along(short_period_model(), [flown(short_period_model())], nothing, UNSCENTED)


def test_gaps_are_refused():
    manoeuvre = flown(short_period_model())
    outputs = manoeuvre.outputs.copy()
    outputs[5, 0] = np.nan
    with pytest.raises(InputError, match=r"output alpha has gaps, the first at 0\.10 s; a Kalman filter needs every"):
        filter_along(short_period_model(), [with_outputs(manoeuvre, outputs)], TOLD, EXTENDED)
