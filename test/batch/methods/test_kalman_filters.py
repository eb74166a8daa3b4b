"""Extended and unscented Kalman filters, against the published runs and against a linear problem's exact answer."""

import jax.numpy as jnp
import numpy as np
import pytest
from made_models import NOISE, SHORT_PERIOD, flown, noisy, short_period_model, with_outputs
from reference_flights import HFB_EKF, HFB_FILTER_NOISE, HFB_UKF, hfb_320
from scipy.optimize import minimize_scalar

from sysid_node.batch.methods.kalman_filters import (
    _iterated_correct,
    extended_kalman,
    iterated_kalman,
    unscented_kalman,
)
from sysid_node.batch.methods.output_error import output_error
from sysid_node.errors import InputError

FILTERS = pytest.mark.parametrize(
    "method", [extended_kalman, iterated_kalman, unscented_kalman], ids=["extended", "iterated", "unscented"]
)


@pytest.fixture(scope="module")
def hfb(flights):
    case = hfb_320(flights)
    r, q = (np.array(variances) for variances in HFB_FILTER_NOISE)
    # the published programs add q / dt at every step
    return case, q / case.manoeuvre.step**2, r, np.full(15, np.sqrt(10.0))


def test_the_extended_filter_gives_the_published_figures(hfb):
    case, q, r, deviation = hfb
    final = extended_kalman(case.model, case.manoeuvre, q, r, deviation).final
    for name, (value, error) in HFB_EKF.items():
        assert abs(final[name].value - value) < 0.05 * error, name
        if name != "Cm_de":  # its error was not published
            assert final[name].standard_error == pytest.approx(error, rel=0.05), name


def test_the_unscented_filter_gives_the_published_figures(hfb):
    case, q, r, deviation = hfb
    final = unscented_kalman(case.model, case.manoeuvre, q, r, deviation).final
    for name, value in HFB_UKF.items():
        assert abs(final[name].value - value) < 0.1 * HFB_EKF[name][1], name


@FILTERS
def test_all_end_near_maximum_likelihood(method):
    start = {name: 0.8 * value for name, value in SHORT_PERIOD.items()}
    manoeuvre = noisy(flown(short_period_model()), np.random.default_rng(1))
    deviation = np.array([1e-4, 1e-4, *(0.3 * abs(v) for v in SHORT_PERIOD.values())])
    track = method(short_period_model(start), manoeuvre, np.zeros(2), NOISE**2, deviation)
    best = output_error(short_period_model(), [manoeuvre])
    for name, estimate in track.final.items():
        assert abs(estimate.value - best.values[name]) < best.estimates[name].white_error, name
        assert estimate.standard_error == pytest.approx(best.estimates[name].white_error, rel=0.25), name
    assert track.values.shape == track.errors.shape == (len(manoeuvre), 5)
    assert (track.errors[-1] < track.errors[0]).all()


def test_the_iterated_correction_is_the_most_probable_state():
    """A square is measured: prior and measurement together are least squares, which Gauss-Newton solves."""
    (found,), covariance = _iterated_correct(
        lambda x: x**2, (jnp.array([2.5]), jnp.array([[1.0]])), jnp.array([9.0]), jnp.array([0.04])
    )
    best = minimize_scalar(lambda x: (x - 2.5) ** 2 + (9.0 - x**2) ** 2 / 0.04, bounds=(1.0, 5.0), method="bounded")
    assert float(found) == pytest.approx(best.x, abs=1e-4)
    assert float(covariance[0, 0]) == pytest.approx(1.0 / (1.0 + (2.0 * best.x) ** 2 / 0.04), rel=1e-3)


def test_a_filter_that_breaks_down_is_refused():
    manoeuvre = flown(short_period_model())
    with pytest.raises(InputError, match="the recursive filter diverged at"):
        unscented_kalman(short_period_model(), manoeuvre, np.zeros(2), NOISE**2, np.zeros(7))


def test_gaps_are_refused():
    manoeuvre = flown(short_period_model())
    outputs = manoeuvre.outputs.copy()
    outputs[5, 0] = np.nan
    with pytest.raises(InputError, match="needs every sample"):
        extended_kalman(short_period_model(), with_outputs(manoeuvre, outputs), np.zeros(2), NOISE**2, np.full(7, 1e-3))
