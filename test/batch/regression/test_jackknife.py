"""Jackknife covariance against its definition by refitting, and against the scatter of many estimates."""

import numpy as np

from sysid_node.batch.regression.jackknife import jackknife


def regression(rng, samples=400):
    """A level and a slope on white noise whose size follows the regressor's: what no fixed spectrum describes."""
    x = np.repeat(rng.normal(size=samples // 8), 8)
    X = np.column_stack([np.ones(samples), x])
    return X, X @ [1.0, 2.0] + (0.2 + np.abs(x)) * rng.normal(size=samples)


def solved(X, y):
    return np.linalg.solve(X.T @ X, X.T @ y)


def test_it_is_the_scatter_of_estimates_without_a_block_each():
    X, y = regression(np.random.default_rng(1))
    whole = solved(X, y)
    left = np.array([solved(np.delete(X, b, axis=0), np.delete(y, b)) for b in np.split(np.arange(400), 20)])
    exact = 19 / 20 * (left - whole).T @ (left - whole)
    found, freedom = jackknife(X.T @ X, [X[:, None, :]], [(y - X @ whole)[:, None]], blocks=20)
    np.testing.assert_allclose(found, exact, rtol=1e-9)
    assert freedom == 19.0


def test_it_is_right_where_noise_grows_with_the_regressor():
    rng = np.random.default_rng(2)
    values, said = [], []
    for _ in range(200):
        X, y = regression(rng)
        value = solved(X, y)
        found, _ = jackknife(X.T @ X, [X[:, None, :]], [(y - X @ value)[:, None]])
        values.append(value)
        said.append(np.sqrt(np.diag(found)))
    np.testing.assert_allclose(np.mean(said, axis=0), np.std(values, axis=0), rtol=0.15)  # of 200 scatters: 5 %


def test_manoeuvres_are_cut_apart_and_what_only_one_shows_is_not_made_up():
    X, y = regression(np.random.default_rng(3))
    errors = (y - X @ solved(X, y))[:, None]
    slopes = np.concatenate([X, np.zeros((400, 1))], axis=1)[:, None, :]  # nothing shows the third
    information = np.tensordot(slopes, slopes, axes=([0, 1], [0, 1]))
    found, freedom = jackknife(information, [slopes[:100], slopes[100:]], [errors[:100], errors[100:]])
    assert freedom == 39.0
    assert found[2].tolist() == [0.0, 0.0, 0.0]
