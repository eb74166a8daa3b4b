"""Filter error: a flight in turbulence against the published analysis, known process noise, textbook Kalman filters."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from made_models import NOISE, SHORT_PERIOD, flown, short_period_model, with_outputs
from reference_flights import HFB_FILTER_ERROR, HFB_FILTER_ERROR_DET, hfb_320
from scipy.linalg import expm, solve_discrete_are

from sysid_node.batch.likelihood import steady_kalman_filter
from sysid_node.batch.likelihood.rollout import rk4_step
from sysid_node.batch.methods.filter_error import filter_error, predict_filter_error
from sysid_node.batch.methods.output_error import output_error
from sysid_node.batch.models.model import Parameter
from sysid_node.errors import InputError

GUSTS = np.array([0.02, 0.4])  # process noise of alpha and q, per root second


def in_gusts(rng, seconds=20.0, gusts=GUSTS):
    """A manoeuvre whose state is pushed about at random, with sensor noise on top."""
    model = short_period_model()
    calm = flown(model, seconds)
    system = np.array([[SHORT_PERIOD["Za"], 1.0], [SHORT_PERIOD["Ma"], SHORT_PERIOD["Mq"]]])
    control = np.array([SHORT_PERIOD["Zd"], SHORT_PERIOD["Md"]])
    x, outputs = np.zeros(2), np.empty_like(calm.outputs)
    fine = 10
    dt = calm.step / fine
    for k, de in enumerate(calm.inputs[:, 0]):
        outputs[k] = *x, 18.0 * (SHORT_PERIOD["Za"] * x[0] + SHORT_PERIOD["Zd"] * de)
        following = calm.inputs[min(k + 1, len(calm) - 1), 0]
        for i in range(fine):
            u = de + (i + 0.5) / fine * (following - de)
            x = x + dt * (system @ (x + 0.5 * dt * (system @ x + control * u)) + control * u)
            x = x + gusts * np.sqrt(dt) * rng.normal(size=2)
    return with_outputs(calm, outputs + NOISE * rng.normal(size=outputs.shape))


def test_hfb_320_agrees_with_the_published_filter_error(flights):
    case = hfb_320(flights)
    fit = filter_error(case.model, [case.manoeuvre])
    assert fit.converged
    for name, value in HFB_FILTER_ERROR.items():
        assert abs(fit.values[name] - value) < 2.0 * fit.estimates[name].standard_error, name
    assert np.exp(fit.log_det) < HFB_FILTER_ERROR_DET
    biased = output_error(case.model, [case.manoeuvre])
    assert fit.values["CL_alpha"] - biased.values["CL_alpha"] > 0.9  # turbulence taken for an answer to the controls


def test_the_filter_and_the_truth_are_found():
    """The innovations show the noises by the gain alone, in which several mixtures of them are nearly the same."""
    model, manoeuvre = short_period_model(), in_gusts(np.random.default_rng(1), 40.0)
    fit = filter_error(model, [manoeuvre])
    assert fit.converged
    found = [(e.value - SHORT_PERIOD[n]) / e.standard_error for n, e in fit.estimates.items()]
    assert np.abs(found).max() < 3.5
    noises = [fit.extras[f"{kind}_{name}"] for kind, names in _NOISES for name in names]
    gains = [gain(manoeuvre.step, np.square(n)) for n in (noises, [*GUSTS, *NOISE])]
    scale = NOISE[None, :] / np.array([[NOISE[0]], [NOISE[1]]])  # of what each output's noise makes of each state
    assert np.linalg.norm((gains[0] - gains[1]) * scale) < 0.15 * np.linalg.norm(gains[1] * scale)


_NOISES = (("process", ("alpha", "q")), ("sensor", ("alpha", "q", "az")))
_C = np.array([[1.0, 0.0], [0.0, 1.0], [18.0 * SHORT_PERIOD["Za"], 0.0]])


def transition(dt):
    A = np.array([[SHORT_PERIOD["Za"], 1.0], [SHORT_PERIOD["Ma"], SHORT_PERIOD["Mq"]]])
    return A, expm(A * dt)


def gain(dt, variances):
    """The textbook steady gain for variances of process noise (alpha, q; per second) and sensor noise."""
    F, Q, R = transition(dt)[1], sampled_noise(np.diag(variances[:2]), dt), np.diag(variances[2:])
    P = solve_discrete_are(F.T, _C.T, Q, R)
    return P @ _C.T @ np.linalg.inv(_C @ P @ _C.T + R)


def test_intervals_hold_the_truth_in_gusts():
    model, rng, inside = short_period_model(), np.random.default_rng(2), []
    for _ in range(12):
        fit = filter_error(model, [in_gusts(rng)])
        inside += [e.lower < SHORT_PERIOD[n] < e.upper for n, e in fit.estimates.items()]
    assert np.mean(inside) > 0.85  # 60 trials: one standard deviation is 3 %


def test_gusts_make_it_better_than_output_error():
    rng = np.random.default_rng(3)
    worse = []
    for _ in range(3):
        manoeuvre = in_gusts(rng)
        errors = [
            f(short_period_model(), [manoeuvre]).values["Md"] - SHORT_PERIOD["Md"] for f in (filter_error, output_error)
        ]
        worse.append(abs(errors[1]) / abs(errors[0]))
    assert np.median(worse) > 1.5


def test_the_steady_covariance_solves_the_riccati_equation():
    rng = np.random.default_rng(4)
    F = 0.9 * np.linalg.qr(rng.normal(size=(4, 4)))[0]
    F[3, 3] = 1.02  # an unstable mode, observed
    C, q, r = rng.normal(size=(3, 4)), rng.uniform(0.01, 1.0, 4), rng.uniform(0.01, 1.0, 3)
    Q = np.diag(q)
    exact = solve_discrete_are(F.T, C.T, Q, np.diag(r))
    np.testing.assert_allclose(
        steady_kalman_filter.steady_covariance(*map(jnp.asarray, (F, C, Q, r))), exact, rtol=1e-9, atol=1e-12
    )


def sampled_noise(Q, dt):
    """What continuous process noise adds to the state within a step: Van Loan, IEEE Trans. AC 23(3), 1978."""
    A, _ = transition(dt)
    both = expm(dt * np.block([[-A, Q], [np.zeros((2, 2)), A.T]]))
    return both[2:, 2:].T @ both[:2, 2:]


def test_predictions_are_those_of_a_kalman_filter_written_out():
    model, manoeuvre = short_period_model(), in_gusts(np.random.default_rng(5), 5.0)
    q, r, theta = GUSTS**2, NOISE**2, model.start
    found = steady_kalman_filter.predictions(
        model.dynamics, manoeuvre.time, manoeuvre.inputs, manoeuvre.outputs, jnp.zeros(2), jnp.asarray(theta), q, r
    )
    dt, u = manoeuvre.step, manoeuvre.inputs
    step = jax.jit(partial(rk4_step, model.dynamics))
    C, K = _C, gain(dt, np.r_[q, r])
    x = np.zeros(2)
    for k in range(len(manoeuvre) - 1):
        predicted = C @ x + np.array([0.0, 0.0, 18.0 * SHORT_PERIOD["Zd"] * u[k, 0]])
        np.testing.assert_allclose(found[k], predicted, rtol=1e-5, atol=1e-6)  # Simpson's rule against the exponential
        x = step(x + K @ (manoeuvre.outputs[k] - predicted), u[k], u[k + 1], dt, theta)


def test_predictions_of_the_fitted_flight_are_the_fits():
    manoeuvre = in_gusts(np.random.default_rng(6))
    fit = filter_error(short_period_model(), [manoeuvre])
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
    parameters = tuple(Parameter(n, v, lower=lowest if n == "Mq" else -np.inf) for n, v in starts.items())
    fit = filter_error(short_period_model().changed(parameters=parameters), [in_gusts(np.random.default_rng(2))])
    assert fit.estimates["Mq"].status == f"at its lower bound {lowest:g}"
    assert not fit.estimates["Mq"].valid
    assert fit.estimates["Md"].valid
