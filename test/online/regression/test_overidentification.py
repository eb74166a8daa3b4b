"""Whether bands of lines tell the same derivatives, against the chi-squared distribution and made disagreement."""

import numpy as np
import pytest
from made_lines import INSTRUMENTAL, ROWS, STRUCTURE, information, made
from numpy.typing import NDArray
from scipy.stats import chi2, norm
from scipy.stats import t as student

from sysid_node.online.regression import least_squares
from sysid_node.online.regression.information import BANDS
from sysid_node.online.regression.overidentification import overidentification, variance_factors

Array = NDArray[np.float64]
EQUATIONS = INSTRUMENTAL
FREEDOM = (BANDS - 1) * EQUATIONS.structure.belongs.sum(axis=0)
ROLL, DAMPING = list(STRUCTURE).index("Cl"), EQUATIONS.structure.unknowns(list(STRUCTURE).index("Cl"))[0]


def flight(seed: int, scatter: float = 0.0) -> tuple[Array, Array]:
    """Lines of strong instruments, and the truth of ``Cl_p``, which is off by ``scatter`` at random in each band."""
    lines, truth = made(EQUATIONS, seed)
    rng = np.random.default_rng(seed + 10_000)
    lines[:, EQUATIONS.instruments] += 2.0 * lines[:, EQUATIONS.columns]
    off = np.repeat(rng.normal(scale=scatter, size=BANDS), ROWS // BANDS) if scatter else 0.0
    lines[:, EQUATIONS.outputs[ROLL]] += off * lines[:, EQUATIONS.columns[DAMPING]]
    return lines, truth["Cl"]


def band_test(lines: Array) -> tuple[Array, least_squares.Solution, least_squares.Uncertainty]:
    info = information(lines, 1.0)
    solution = least_squares.solve(EQUATIONS, info.grams.sum(axis=0))
    spread = least_squares.uncertainty(EQUATIONS, solution, info)
    return overidentification(EQUATIONS, solution, info, spread), solution, spread


def test_bands_that_tell_the_same_scatter_as_chi_squared() -> None:
    found = np.array([band_test(flight(seed)[0])[0] for seed in range(400)]) * FREEDOM
    np.testing.assert_allclose(found.mean(axis=0), FREEDOM, rtol=0.06)
    for level in (0.5, 0.95):
        share = (found < chi2.ppf(level, FREEDOM)).mean(axis=0)
        np.testing.assert_allclose(share, level, atol=0.07)


def test_an_equation_whose_bands_disagree_is_told_from_all_others() -> None:
    found = np.mean([band_test(flight(seed, scatter=1.0)[0])[0] for seed in range(20)], axis=0)
    assert found[ROLL] > 8.0
    np.testing.assert_allclose(np.delete(found, ROLL), 1.0, atol=0.3)


def test_what_explains_all_bands_alike_is_no_disagreement() -> None:
    """Another value of the derivatives, of which the solution knows nothing, changes nothing."""
    lines, _ = flight(1)
    before, *_ = band_test(lines)
    lines[:, EQUATIONS.outputs[ROLL]] += 5.0 * lines[:, EQUATIONS.columns[DAMPING]]
    np.testing.assert_allclose(band_test(lines)[0], before, rtol=1e-6)


@pytest.mark.parametrize(("scatter", "least", "without"), [(0.0, 0.91, 0.99), (0.3, 0.85, 0.55)])
def test_intervals_hold_where_bands_scatter_about_the_truth(scatter: float, least: float, without: float) -> None:
    """Of 300 flights: with the factor most intervals hold, and without it few do where bands scatter."""
    inside, bare = [], []
    for seed in range(300):
        lines, truth = flight(seed, scatter)
        found, solution, spread = band_test(lines)
        factor = variance_factors(EQUATIONS, found, BANDS)[ROLL]
        error, variance = solution.theta[DAMPING, ROLL] - truth[0], spread.covariance[ROLL, DAMPING, DAMPING]
        inside.append(abs(error) < 1.96 * np.sqrt(factor * variance))
        bare.append(abs(error) < 1.96 * np.sqrt(variance))
    assert np.mean(inside) > least
    assert np.mean(bare) < without


def test_chance_makes_no_interval_wider() -> None:
    """Up to two standard deviations of J nothing is added, and far beyond that all of it, by Student's factor."""
    chance = 1.0 + 2.0 * np.sqrt(2.0 / FREEDOM)
    np.testing.assert_allclose(variance_factors(EQUATIONS, np.zeros_like(FREEDOM), BANDS), 1.0)
    np.testing.assert_allclose(variance_factors(EQUATIONS, chance, BANDS), 1.0)
    far = 100.0 * (student.ppf(0.975, FREEDOM) / norm.ppf(0.975)) ** 2
    np.testing.assert_allclose(variance_factors(EQUATIONS, np.full_like(FREEDOM, 100.0), BANDS), far, rtol=0.02)


def test_what_did_not_move_tells_nothing() -> None:
    lines, _ = flight(2)
    lines[:, [EQUATIONS.instruments[DAMPING], EQUATIONS.columns[DAMPING]]] = 0.0
    assert np.isfinite(band_test(lines)[0]).all()
