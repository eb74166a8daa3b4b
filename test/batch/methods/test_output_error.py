"""Maximum likelihood by output error: published analyses of real flights, known truth, and what can go wrong."""

import dataclasses

import numpy as np
import pytest
from made_models import NOISE, SHORT_PERIOD, flown, noisy, short_period_model, with_outputs
from reference_flights import (
    ATTAS_OUTPUT_ERROR,
    HFB_OUTPUT_ERROR,
    HFB_OUTPUT_ERROR_DET,
    TWIN_OTTER_OUTPUT_ERROR,
    attas_lateral,
    hfb_320,
    twin_otter,
)

from sysid_node.batch.likelihood.maximum_likelihood import SearchOptions
from sysid_node.batch.methods.output_error import output_error, predict_output_error
from sysid_node.batch.models.model import ModelParameter
from sysid_node.errors import InputError

WRONG_START = {"Za": -3.0, "Zd": -0.1, "Ma": -25.0, "Mq": -4.0, "Md": -40.0}


def scores(fit, truth=SHORT_PERIOD):
    """Errors in standard errors."""
    return np.array([(e.value - truth[name]) / e.standard_error for name, e in fit.estimates.items()])


# -- real flights against the authors' own programs -------------------------------------------------------------------


def test_hfb_320_gives_jategaonkars_figures(flights):
    case = hfb_320(flights)
    fit = output_error(case.model, [case.manoeuvre])
    assert fit.search.converged
    for name, (value, error) in HFB_OUTPUT_ERROR.items():
        assert abs(fit.values[name] - value) < 0.2 * error, name
        assert fit.estimates[name].white_error == pytest.approx(error, rel=0.05), name
    assert np.exp(fit.log_det) == pytest.approx(HFB_OUTPUT_ERROR_DET, rel=1e-3)


def test_attas_lateral_is_as_near_as_differentiated_rates_allow(flights):
    case = attas_lateral(flights)
    fit = output_error(case.model, [case.manoeuvre])
    assert fit.search.converged
    for name, (value, _) in ATTAS_OUTPUT_ERROR.items():
        assert abs(fit.values[name] - value) < fit.estimates[name].standard_error, name


def test_twin_otter_gives_sidpacs_figures_and_coloured_errors(flights):
    case = twin_otter(flights)
    fit = output_error(case.model, [case.manoeuvre])
    assert fit.search.converged
    for name, (value, error) in TWIN_OTTER_OUTPUT_ERROR.items():
        assert abs(fit.values[name] - value) < 0.2 * error, name
        assert fit.estimates[name].standard_error == pytest.approx(error, rel=0.1), name


# -- known truth ------------------------------------------------------------------------------------------------------


def test_exact_data_give_the_exact_truth():
    fit = output_error(short_period_model(WRONG_START), [flown(short_period_model())])
    np.testing.assert_allclose(list(fit.values.values()), list(SHORT_PERIOD.values()), rtol=1e-6)
    assert fit.search.converged


@pytest.mark.slow
@pytest.mark.parametrize("colour", [0.0, 0.2], ids=["white", "coloured"])
def test_intervals_hold_the_truth(colour):
    model, true = short_period_model(), flown(short_period_model())
    rng = np.random.default_rng(11)
    inside = []
    for _ in range(60):
        fit = output_error(model, [noisy(true, rng, colour=colour)])
        inside += [e.lower < SHORT_PERIOD[name] < e.upper for name, e in fit.estimates.items()]
    assert 0.90 < np.mean(inside) < 0.995  # 300 trials: one standard deviation is 1.3 %


def test_more_manoeuvres_make_smaller_errors():
    true = flown(short_period_model())
    one = output_error(short_period_model(), [noisy(true, np.random.default_rng(1))])
    four = output_error(short_period_model(), [noisy(true, np.random.default_rng(k)) for k in range(4)])
    ratio = [four.estimates[n].standard_error / one.estimates[n].standard_error for n in SHORT_PERIOD]
    np.testing.assert_allclose(ratio, 0.5, rtol=0.35)
    assert np.abs(scores(four)).max() < 3.5


def test_initial_states_and_biases_belong_to_each_manoeuvre():
    model, rng = short_period_model(), np.random.default_rng(2)
    starts, biases = [(0.03, 0.2), (-0.02, 0.0)], [0.4, -0.2]
    manoeuvres = []
    for start, bias in zip(starts, biases, strict=True):
        true = flown(model, initial=start)
        shifted = with_outputs(true, true.outputs + np.array([0.0, 0.0, bias]))
        manoeuvres.append(dataclasses.replace(noisy(shifted, rng), initial_state=np.zeros(2)))
    fit = output_error(model, manoeuvres, initial_states=("alpha", "q"), biases=("az",))
    for own, start, bias in zip(fit.nuisance, starts, biases, strict=True):
        assert own["alpha(0)"] == pytest.approx(start[0], abs=0.003)
        assert own["q(0)"] == pytest.approx(start[1], abs=0.02)
        assert own["bias_az"] == pytest.approx(bias, abs=0.02)
    assert np.abs(scores(fit)).max() < 3.5


def test_the_noise_is_found():
    fit = output_error(
        short_period_model(), [noisy(flown(short_period_model(), seconds=40.0), np.random.default_rng(3))]
    )
    np.testing.assert_allclose(list(fit.noise.values()), NOISE, rtol=0.08)


def test_other_flights_are_answered_with_their_own_initial_state():
    model = short_period_model()
    other = dataclasses.replace(
        noisy(flown(model, initial=(0.03, 0.2)), np.random.default_rng(4)), initial_state=np.zeros(2)
    )
    (response,) = predict_output_error(model, [other], SHORT_PERIOD, initial_states=("alpha", "q"))
    np.testing.assert_allclose(response.residuals.std(axis=0), NOISE, rtol=0.15)
    (held,) = predict_output_error(model, [other], SHORT_PERIOD)
    assert held.residuals[:, 1].std() > 1.5 * NOISE[1]


# -- priors, bounds, gaps ---------------------------------------------------------------------------------------------


def test_a_prior_counts_by_its_uncertainty():
    manoeuvre = noisy(flown(short_period_model()), np.random.default_rng(5))
    free = output_error(short_period_model(), [manoeuvre])
    error = free.estimates["Mq"].white_error

    mean = free.values["Mq"] - 2.0 * error

    def with_prior(sigma):
        model = short_period_model()
        parameters = [dataclasses.replace(p, prior=(mean, sigma)) if p.name == "Mq" else p for p in model.parameters]
        return output_error(model.changed(parameters=tuple(parameters)), [manoeuvre]).values["Mq"]

    assert with_prior(1e-6) == pytest.approx(mean, abs=1e-4)
    assert with_prior(1e3) == pytest.approx(free.values["Mq"], abs=1e-3)
    assert with_prior(error) == pytest.approx(mean + error, abs=0.1 * error)  # as sharp as the data: midway


def test_a_parameter_at_its_bound_is_named_and_not_valid():
    parameters = [
        ModelParameter(n, v, lower=-5.0 if n == "Mq" else -np.inf) for n, v in (SHORT_PERIOD | {"Mq": -4.0}).items()
    ]
    model = short_period_model().changed(parameters=tuple(parameters))
    fit = output_error(model, [noisy(flown(short_period_model()), np.random.default_rng(6))])
    assert fit.estimates["Mq"].value == pytest.approx(-5.0, abs=1e-4)
    assert fit.estimates["Mq"].status == "at its lower bound -5"
    assert not fit.estimates["Mq"].valid
    assert fit.estimates["Md"].valid
    assert "Mq ended at its lower bound -5" in fit.remarks


def test_a_fixed_parameter_stays():
    parameters = [ModelParameter(n, v, fixed=n == "Zd") for n, v in (SHORT_PERIOD | {"Zd": -0.5}).items()]
    fit = output_error(
        short_period_model().changed(parameters=tuple(parameters)),
        [noisy(flown(short_period_model()), np.random.default_rng(6))],
    )
    assert set(fit.estimates) == {"Za", "Ma", "Mq", "Md"}
    with pytest.raises(InputError, match="every parameter is fixed"):
        output_error(short_period_model(fixed=True), [flown(short_period_model())])


def test_gaps_in_an_output_count_as_not_measured():
    manoeuvre = noisy(flown(short_period_model()), np.random.default_rng(7))
    outputs = manoeuvre.outputs.copy()
    outputs[::2, 0] = np.nan  # a vane at half the rate
    outputs[200:240] = np.nan  # nothing at all for a while
    fit = output_error(short_period_model(WRONG_START), [with_outputs(manoeuvre, outputs)])
    assert fit.search.converged
    assert np.abs(scores(fit)).max() < 3.5
    assert np.isfinite(fit.covariance).all()


# -- what a flight does not show --------------------------------------------------------------------------------------


def test_a_still_flight_determines_nothing_and_says_so():
    model = short_period_model()
    still = with_outputs(flown(model), np.zeros((500, 3)))
    still = dataclasses.replace(noisy(still, np.random.default_rng(8)), inputs=np.zeros((500, 1)))
    fit = output_error(model, [still])
    assert not any(e.valid for e in fit.estimates.values())
    assert all(np.isfinite(e.value) for e in fit.estimates.values())
    assert any("nothing here" in remark for remark in fit.remarks)


def test_two_names_for_one_effect_cannot_be_told_apart():
    model = short_period_model()

    def derivative(x, u, theta):
        alpha_rate, q_rate = model.derivative(x, u, theta[:5])
        return alpha_rate, q_rate + theta[5] * u[0]

    doubled = model.changed(
        parameters=(*model.parameters, ModelParameter("Md2", 0.0)),
        derivative=derivative,
        output=lambda x, u, theta: model.output(x, u, theta[:5]),
    )
    fit = output_error(doubled, [noisy(flown(model), np.random.default_rng(9))])
    assert fit.estimates["Md"].status == "collinear with Md2"
    assert fit.estimates["Md2"].status == "collinear with Md"
    assert fit.estimates["Mq"].valid
    assert fit.values["Md"] + fit.values["Md2"] == pytest.approx(SHORT_PERIOD["Md"], rel=0.02)
    assert "nothing here determines Md, Md2 apart from one another" in fit.remarks


def test_hardly_separable_parameters_are_named(flights):
    case = hfb_320(flights)
    fit = output_error(case.model, [case.manoeuvre])
    assert any(remark.startswith("CL_0 and CL_V are hard to tell apart here") for remark in fit.remarks)


# -- what cannot be done ----------------------------------------------------------------------------------------------


def test_a_diverging_model_is_refused_with_the_time():
    with pytest.raises(InputError, match=r"diverges from its start values: \w+ is more than a million times the meas"):
        output_error(short_period_model({"Ma": 9e5}), [flown(short_period_model(), seconds=20.0)])


def test_too_short_a_flight_is_refused():
    short = flown(short_period_model(), seconds=0.12)
    with pytest.raises(InputError, match="18 measured values for 10 unknowns; give longer manoeuvres"):
        output_error(short_period_model(), [short], initial_states=("alpha", "q"), biases=("alpha", "q", "az"))


def test_a_search_cut_short_says_so():
    fit = output_error(
        short_period_model(WRONG_START),
        [noisy(flown(short_period_model()), np.random.default_rng(10))],
        search=SearchOptions(rounds=1, evaluations=2),
    )
    assert not fit.search.converged
    assert "not converged after 1 rounds" in fit.search.message


def test_an_unknown_name_is_refused():
    with pytest.raises(InputError, match="no state 'theta'; known: alpha, q"):
        output_error(short_period_model(), [flown(short_period_model())], initial_states=("theta",))
    with pytest.raises(InputError, match="no output 'V'"):
        output_error(short_period_model(), [flown(short_period_model())], biases=("V",))
