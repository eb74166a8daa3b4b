"""Linear regression with errors for coloured residuals."""

import numpy as np
import pytest

from sysid_node.batch.regression.linear_regression import regress
from sysid_node.errors import InputError


def data(rng, flights=1, samples=800):
    Xs = [np.column_stack([np.ones(samples), rng.normal(size=(samples, 2))]) for _ in range(flights)]
    return [X @ [0.5, 2.0, -1.0] + 0.3 * rng.normal(size=samples) for X in Xs], Xs


def test_white_noise_gives_the_textbook_errors():
    ys, Xs = data(np.random.default_rng(1))
    fit = regress(["0", "a", "b"], ys, Xs)
    residual = ys[0] - Xs[0] @ np.linalg.lstsq(Xs[0], ys[0], rcond=None)[0]
    textbook = np.sqrt(np.diag(np.linalg.inv(Xs[0].T @ Xs[0])) * (residual @ residual) / (800 - 3))
    np.testing.assert_allclose([e.value for e in fit.estimates.values()], [0.5, 2.0, -1.0], atol=0.04)
    np.testing.assert_allclose([e.white_error for e in fit.estimates.values()], textbook, rtol=1e-9)
    np.testing.assert_allclose([e.standard_error for e in fit.estimates.values()], textbook, rtol=0.25)
    assert fit.noise == pytest.approx(0.3, rel=0.1)


def test_flights_together_are_one_fit():
    ys, Xs = data(np.random.default_rng(2), flights=2)
    both = np.linalg.lstsq(np.concatenate(Xs), np.concatenate(ys), rcond=None)[0]
    np.testing.assert_allclose([e.value for e in regress(["0", "a", "b"], ys, Xs).estimates.values()], both, rtol=1e-9)


def test_collinear_regressors_are_named_and_share_their_effect():
    ys, Xs = data(np.random.default_rng(3))
    fit = regress(["0", "a", "b", "c"], ys, [np.column_stack([X, 2.0 * X[:, 1]]) for X in Xs])
    assert fit.unidentifiable == (("a", "c"),)
    assert fit.estimates["a"].status == "collinear with c"
    assert not fit.estimates["c"].valid
    assert fit.estimates["b"].valid
    assert fit.estimates["a"].value + 2.0 * fit.estimates["c"].value == pytest.approx(2.0, abs=0.05)


def test_a_regressor_that_never_moves_is_not_excited():
    ys, Xs = data(np.random.default_rng(4))
    fit = regress(["0", "a", "b", "still"], ys, [np.column_stack([X, np.zeros(800)]) for X in Xs])
    assert fit.estimates["still"].status == "not excited"
    assert np.isfinite(fit.estimates["still"].value)
    assert fit.estimates["a"].valid


def test_too_few_samples_are_refused():
    with pytest.raises(InputError, match="5 samples for 3 regressors"):
        regress(["0", "a", "b"], [np.zeros(5)], [np.zeros((5, 3))])
