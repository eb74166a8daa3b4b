"""The covariance for coloured residuals, against the double sum it stands for and against Monte Carlo."""

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from sysid_node.batch.regression import coloured_residuals


def double_sum(inverse, sensitivities, residuals):
    """Klein & Morelli eq. 6.45 as written, with the same lag window."""
    width = max(2, int(coloured_residuals.LAG_SHARE * max(len(r) for r in residuals)))
    lag = np.arange(width + 1) / width
    window = np.where(lag <= 0.5, 1 - 6 * lag**2 + 6 * lag**3, 2 * np.clip(1 - lag, 0, None) ** 3)
    rows = sum(len(r) for r in residuals)
    correlation = np.array([sum(r[: len(r) - m].T @ r[m:] for r in residuals) for m in range(width + 1)]) / rows
    inner = 0.0
    for S in sensitivities:
        for i in range(len(S)):
            for j in range(max(0, i - width), min(len(S), i + width + 1)):
                R = correlation[j - i] if j >= i else correlation[i - j].T
                inner = inner + window[abs(i - j)] * S[i].T @ R @ S[j]
    return inverse @ inner @ inverse


@pytest.mark.parametrize("lengths", [(60,), (50, 70)])
def test_the_frequency_domain_sum_is_the_double_sum(lengths):
    rng = np.random.default_rng(1)
    sensitivities = [rng.normal(size=(n, 2, 3)) for n in lengths]
    residuals = [rng.normal(size=(n, 2)) for n in lengths]
    for r in residuals:
        r[1:, 1] += 0.8 * r[:-1, 0]  # correlated across channels, one behind the other
    inverse = np.linalg.inv(sum(np.einsum("nop,noq->pq", S, S) for S in sensitivities))
    found = coloured_residuals.coloured_covariance(inverse, sensitivities, residuals, iterations=0)
    np.testing.assert_allclose(found, double_sum(inverse, sensitivities, residuals), rtol=1e-10, atol=1e-15)


def regression(rng, shape, samples=600):
    """One least-squares fit to noise of a colour: estimates (truth 0), their covariance, and the white one."""
    time = np.arange(samples) * 0.02
    steps = np.sign(np.sin(2 * np.pi * 0.4 * time)) * (time > 1.0)
    X = np.column_stack([lfilter([0.04], [1.0, -1.85, 0.87], steps), steps])
    noise = lfilter(*shape, rng.normal(size=samples + 500))[500:]
    inverse = np.linalg.inv(X.T @ X)
    values = inverse @ X.T @ noise
    residual = noise - X @ values
    covariance = coloured_residuals.coloured_covariance(inverse, [X[:, None, :]], [residual[:, None]])
    return values, covariance, inverse * residual.var()


@pytest.mark.parametrize(
    "shape",
    [([1.0], [1.0]), ([1.0], [1.0, -0.8]), ([1.0], [1.0, -0.96]), ([1.0], [1.0, -1.9, 0.95])],
    ids=["white", "0.1 s", "0.5 s", "resonant"],
)
def test_intervals_hold_the_truth_whatever_the_colour(shape):
    rng = np.random.default_rng(7)
    quantile = stats.t.ppf(0.975, coloured_residuals.spectral_degrees_of_freedom([600]))
    inside = []
    for _ in range(200):
        values, covariance, _ = regression(rng, shape)
        inside.append(np.abs(values) < quantile * np.sqrt(np.diag(covariance)))
    assert 0.90 < np.mean(inside) < 0.985  # 400 trials: one standard deviation is 1.1 %


def test_white_errors_do_not_hold_for_coloured_noise():
    rng = np.random.default_rng(8)
    trials = [regression(rng, ([1.0], [1.0, -0.96])) for _ in range(100)]
    inside = [np.abs(values) < 1.96 * np.sqrt(np.diag(white)) for values, _, white in trials]
    assert np.mean(inside) < 0.6


def test_no_variance_is_negative():
    rng = np.random.default_rng(9)
    S = np.cos(np.arange(40) * np.pi)[:, None, None] + 0.01 * rng.normal(size=(40, 1, 2))
    residual = np.linspace(-1.0, 1.0, 40)[:, None]
    inverse = np.linalg.inv(np.einsum("nop,noq->pq", S, S))
    assert np.linalg.eigvalsh(coloured_residuals.coloured_covariance(inverse, [S], [residual])).min() > -1e-9
