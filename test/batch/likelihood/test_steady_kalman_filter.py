"""The steady Kalman filter against SciPy's Riccati solver and a filter written out."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gusty_models import GUSTS, OBSERVATION, gain, in_gusts
from made_models import NOISE, SHORT_PERIOD, short_period_model
from scipy.linalg import solve_discrete_are

from sysid_node.batch.likelihood import steady_kalman_filter
from sysid_node.batch.likelihood.rollout import rk4_step


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


@pytest.mark.slow
def test_predictions_are_those_of_a_kalman_filter_written_out():
    model, manoeuvre = short_period_model(), in_gusts(np.random.default_rng(5), 5.0)
    q, r, theta = GUSTS**2, NOISE**2, model.start
    found = steady_kalman_filter.predictions(
        model.dynamics, manoeuvre.time, manoeuvre.inputs, manoeuvre.outputs, jnp.zeros(2), jnp.asarray(theta), q, r
    )
    dt, u = manoeuvre.step, manoeuvre.inputs
    step = jax.jit(partial(rk4_step, model.dynamics))
    C, K = OBSERVATION, gain(dt, np.r_[q, r])
    x = np.zeros(2)
    for k in range(len(manoeuvre) - 1):
        predicted = C @ x + np.array([0.0, 0.0, 18.0 * SHORT_PERIOD["Zd"] * u[k, 0]])
        np.testing.assert_allclose(found[k], predicted, rtol=1e-5, atol=1e-6)  # Simpson's rule against the exponential
        x = step(x + K @ (manoeuvre.outputs[k] - predicted), u[k], u[k + 1], dt, theta)
