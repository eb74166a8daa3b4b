"""Filter error: a flight in turbulence against the published analysis, and flights with known process noise."""

import numpy as np
import pytest
from gusty_models import GUSTS, gain, in_gusts
from made_models import NOISE, SHORT_PERIOD, short_period_model, with_outputs
from reference_flights import HFB_FILTER_ERROR, HFB_FILTER_ERROR_DET, hfb_320

from sysid_node.batch.methods.filter_error import filter_error, predict_filter_error
from sysid_node.batch.methods.output_error import output_error
from sysid_node.batch.models.model import ModelParameter
from sysid_node.errors import InputError


@pytest.mark.slow
def test_hfb_320_agrees_with_the_published_filter_error(flights):
    case = hfb_320(flights)
    fit = filter_error(case.model, [case.manoeuvre])
    assert fit.search.converged
    for name, value in HFB_FILTER_ERROR.items():
        assert abs(fit.values[name] - value) < 2.0 * fit.estimates[name].standard_error, name
    assert np.exp(fit.log_det) < HFB_FILTER_ERROR_DET
    biased = output_error(case.model, [case.manoeuvre])
    assert fit.values["CL_alpha"] - biased.values["CL_alpha"] > 0.9  # turbulence taken for an answer to the controls


@pytest.fixture(scope="module")
def in_six_flights():
    """Six flights in gusts, and what filter error makes of each."""
    rng = np.random.default_rng(2)
    manoeuvres = [in_gusts(rng) for _ in range(6)]
    return [(manoeuvre, filter_error(short_period_model(), [manoeuvre])) for manoeuvre in manoeuvres]


@pytest.mark.slow
def test_the_filter_and_the_truth_are_found():
    """The innovations show the noises by the gain alone, in which several mixtures of them are nearly the same."""
    model, manoeuvre = short_period_model(), in_gusts(np.random.default_rng(1), 40.0)
    fit = filter_error(model, [manoeuvre])
    assert fit.search.converged
    found = [(e.value - SHORT_PERIOD[n]) / e.standard_error for n, e in fit.estimates.items()]
    assert np.abs(found).max() < 3.5
    noises = [fit.extras[f"{kind}_{name}"] for kind, names in _NOISES for name in names]
    gains = [gain(manoeuvre.step, np.square(n)) for n in (noises, [*GUSTS, *NOISE])]
    scale = NOISE[None, :] / np.array([[NOISE[0]], [NOISE[1]]])  # of what each output's noise makes of each state
    assert np.linalg.norm((gains[0] - gains[1]) * scale) < 0.15 * np.linalg.norm(gains[1] * scale)


_NOISES = (("process", ("alpha", "q")), ("sensor", ("alpha", "q", "az")))


@pytest.mark.slow
def test_intervals_hold_the_truth_in_gusts(in_six_flights):
    inside = [e.lower < SHORT_PERIOD[n] < e.upper for _, fit in in_six_flights for n, e in fit.estimates.items()]
    assert np.mean(inside) > 0.83  # 30 trials: one standard deviation is 4 %


@pytest.mark.slow
def test_gusts_make_it_better_than_output_error(in_six_flights):
    worse = []
    for manoeuvre, fit in in_six_flights:
        errors = [f.values["Md"] - SHORT_PERIOD["Md"] for f in (fit, output_error(short_period_model(), [manoeuvre]))]
        worse.append(abs(errors[1]) / abs(errors[0]))
    assert np.median(worse) > 1.5


@pytest.mark.slow
def test_predictions_of_the_fitted_flight_are_the_fits(in_six_flights):
    manoeuvre, fit = in_six_flights[0]
    (response,) = predict_filter_error(short_period_model(), [manoeuvre], fit.values, fit.extras)
    np.testing.assert_allclose(response.modelled, fit.responses[0].modelled, atol=1e-9)


def test_outputs_with_gaps_are_refused():
    manoeuvre = in_gusts(np.random.default_rng(7), 5.0)
    outputs = manoeuvre.outputs.copy()
    outputs[100:110, 1] = np.nan
    with pytest.raises(InputError, match=r"output q has gaps, the first at 2\.00 s; .* use output_error"):
        filter_error(short_period_model(), [with_outputs(manoeuvre, outputs)])


def test_a_parameter_at_its_bound_is_named_and_not_valid():
    lowest = 0.5 * SHORT_PERIOD["Mq"]
    starts = SHORT_PERIOD | {"Mq": 0.4 * SHORT_PERIOD["Mq"]}
    parameters = tuple(ModelParameter(n, v, lower=lowest if n == "Mq" else -np.inf) for n, v in starts.items())
    fit = filter_error(short_period_model().changed(parameters=parameters), [in_gusts(np.random.default_rng(2))])
    assert fit.estimates["Mq"].status == f"at its lower bound {lowest:g}"
    assert not fit.estimates["Mq"].valid
    assert fit.estimates["Md"].valid
