"""Solutions and covariances against numpy.linalg.lstsq and textbook formulas."""

import math
import warnings

import numpy as np
import pytest
from made_lines import INSTRUMENTAL, PLAIN, ROWS, STRUCTURE, information, layout, made
from numpy.typing import NDArray
from scipy.stats import t as student

from sysid_node.online.regression import least_squares, normal_equations
from sysid_node.online.regression.information import BANDS
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]


def test_plan_shares_blocks_and_knows_its_unknowns() -> None:
    assert PLAIN.structure.coefficients == tuple(STRUCTURE)
    for c, regressors in enumerate(STRUCTURE.values()):
        assert [PLAIN.structure.regressors[i] for i in PLAIN.structure.unknowns(c)] == [
            r for r in regressors if r != "0"
        ]
    assert PLAIN.structure.block[0] == PLAIN.structure.block[2] != PLAIN.structure.block[1]
    assert PLAIN.least_squares
    assert not INSTRUMENTAL.least_squares


def test_all_coefficients_at_once_equal_lstsq_each() -> None:
    lines, _ = made(PLAIN)
    solution = least_squares.solve(PLAIN, lines.T @ lines)
    assert solution.usable
    for c in range(len(STRUCTURE)):
        unknowns = PLAIN.structure.unknowns(c)
        expected, residual, *_ = np.linalg.lstsq(lines[:, PLAIN.columns[unknowns]], lines[:, PLAIN.outputs[c]])
        np.testing.assert_allclose(solution.theta[unknowns, c], expected, rtol=1e-10)
        assert solution.residual[c] == pytest.approx(residual[0], rel=1e-9)
        assert not np.delete(solution.theta[:, c], unknowns).any()


def test_instrumental_variables_are_those_of_two_stages() -> None:
    """Just identified, (Z'A)^-1 Z'y is least squares on the regressors as predicted from all instruments."""
    lines, _ = made(INSTRUMENTAL, 1)
    equations = INSTRUMENTAL
    lines[:, equations.instruments] += lines[
        :, equations.columns
    ]  # instruments that are correlated with their regressors
    solution = least_squares.solve(equations, lines.T @ lines)
    for c in range(len(STRUCTURE)):
        unknowns = equations.structure.unknowns(c)
        A, Z, y = (
            lines[:, equations.columns[unknowns]],
            lines[:, equations.instruments[unknowns]],
            lines[:, equations.outputs[c]],
        )
        predicted = Z @ np.linalg.lstsq(Z, A)[0]
        expected = np.linalg.lstsq(predicted, y)[0]
        np.testing.assert_allclose(solution.theta[unknowns, c], expected, rtol=1e-8)
        assert solution.residual[c] == pytest.approx(np.sum((y - A @ expected) ** 2), rel=1e-9)
        np.testing.assert_allclose(solution.inverse[np.ix_(unknowns, unknowns)], np.linalg.inv(Z.T @ A), rtol=1e-8)


def test_known_noise_is_taken_out_of_the_normal_equations() -> None:
    lines, _ = made(PLAIN, 2)
    gram = lines.T @ lines
    bias = np.diag(np.linspace(1.0, 5.0, PLAIN.width))
    solution = least_squares.solve(PLAIN, gram, least_squares.bias_of(PLAIN, bias))
    unknowns = PLAIN.structure.unknowns(0)
    J, y = PLAIN.columns[unknowns], PLAIN.outputs[0]
    expected = np.linalg.solve((gram - bias)[np.ix_(J, J)], gram[J, y])
    np.testing.assert_allclose(solution.theta[unknowns, 0], expected, rtol=1e-10)
    misfit = lines[:, y] - lines[:, J] @ expected
    assert solution.residual[0] == pytest.approx(misfit @ misfit, rel=1e-9)


@pytest.mark.parametrize("equations", [PLAIN, INSTRUMENTAL], ids=["least squares", "instruments"])
@pytest.mark.parametrize("spoiled", ["nan", "inf", "more noise than motion"])
def test_impossible_equations_are_not_usable_and_never_raise(equations: NormalEquations, spoiled: str) -> None:
    lines, _ = made(equations, 3)
    bias = None
    if spoiled == "more noise than motion":
        if not equations.least_squares:
            pytest.skip("no definiteness is asked of instruments")
        bias = least_squares.bias_of(equations, 1e4 * np.eye(equations.width))
    else:
        lines[5, equations.columns[0]] = float(spoiled)
    with np.errstate(all="ignore"):
        gram = lines.T @ lines
        solution = least_squares.solve(equations, gram, bias)
    assert not solution.usable
    spread = least_squares.uncertainty(equations, solution, information(made(equations)[0], 1.0))
    assert not spread.freedom.any()


@pytest.mark.parametrize("equations", [PLAIN, INSTRUMENTAL], ids=["least squares", "instruments"])
def test_nothing_flown_says_nothing_of_anything(equations: NormalEquations) -> None:
    solution = least_squares.solve(equations, np.zeros((equations.width, equations.width)))
    assert not solution.theta.any()
    assert (solution.inverse.diagonal() > 1e15).all()


@pytest.mark.parametrize("equations", [PLAIN, INSTRUMENTAL], ids=["least squares", "instruments"])
@pytest.mark.parametrize("twin", [True, False], ids=["moves as another", "does not move"])
def test_one_regressor_that_tells_nothing_costs_no_other(equations: NormalEquations, twin: bool) -> None:
    """Their own errors are without bound; the other equations, and the other regressors, are as ever."""
    lines, _ = made(equations, 3)
    alpha, q, de = equations.structure.unknowns(0)
    lines[:, equations.columns[de]] = lines[:, equations.columns[q]] if twin else 0.0
    lines[:, equations.instruments[q]] = lines[:, equations.columns[q]]
    solution = least_squares.solve(equations, lines.T @ lines)
    assert solution.usable
    assert abs(solution.inverse[de, de]) > 1e8
    for c, others in (
        (0, np.array([alpha])),
        (3, equations.structure.unknowns(3)),
        (5, equations.structure.unknowns(5)),
    ):
        J, Z, y = (
            equations.columns[equations.structure.unknowns(c)],
            equations.instruments[equations.structure.unknowns(c)],
            lines[:, equations.outputs[c]],
        )
        used = np.array([0, 1]) if c == 0 else np.arange(J.size)
        expected = np.linalg.solve(lines[:, Z[used]].T @ lines[:, J[used]], lines[:, Z[used]].T @ y)
        np.testing.assert_allclose(solution.theta[others, c], expected[: others.size], rtol=1e-3)


def test_covariance_of_independent_lines_is_the_textbook_one() -> None:
    """Homogeneous white noise: s^2 (A'A)^-1 with s^2 the residual over the degrees of freedom left.

    ``density`` cancels: only products of residual densities and line variances are in the covariance.
    """
    lines, _ = made(PLAIN, 4)
    for c in range(len(STRUCTURE)):  # the same residual in every band
        unknowns = PLAIN.structure.unknowns(c)
        A = lines[:, PLAIN.columns[unknowns]]
        residual = lines[:, PLAIN.outputs[c]] - A @ np.linalg.lstsq(A, lines[:, PLAIN.outputs[c]])[0]
        for part in np.split(np.arange(ROWS), BANDS):
            lines[part, PLAIN.outputs[c]] += residual[part] * (0.3 / np.sqrt(np.mean(residual[part] ** 2)) - 1.0)
    for density in (1.0, 12.5):
        info = information(lines, density)
        solution = least_squares.solve(PLAIN, info.grams.sum(axis=0))
        spread = least_squares.uncertainty(PLAIN, solution, info)
        for c in range(len(STRUCTURE)):
            unknowns = PLAIN.structure.unknowns(c)
            A, y = lines[:, PLAIN.columns[unknowns]], lines[:, PLAIN.outputs[c]]
            s2 = np.sum((y - A @ solution.theta[unknowns, c]) ** 2) / (ROWS - unknowns.size)
            textbook = s2 * np.linalg.inv(A.T @ A)
            found = spread.covariance[c][np.ix_(unknowns, unknowns)]
            np.testing.assert_allclose(found.diagonal(), textbook.diagonal(), rtol=0.05)
            assert spread.density[c] == pytest.approx(s2 / density, rel=1e-9)
            assert spread.freedom[c] == pytest.approx((ROWS - unknowns.size) ** 2 / ROWS, rel=1e-9)


def test_coloured_residuals_count_where_the_regressor_moves() -> None:
    """Noise in the lowest band alone: a regressor that moves there alone is less sure than one that moves elsewhere."""
    lines, _ = made(PLAIN, 5, noise=0.0)
    first = slice(0, ROWS // BANDS)
    lines[:, PLAIN.columns[0]] *= np.where(np.arange(ROWS) < ROWS // BANDS, 1.0, 0.01)
    lines[first, PLAIN.columns[1]] *= 0.01
    lines[first, PLAIN.outputs[0]] += np.random.default_rng(6).normal(size=ROWS // BANDS)
    info = information(lines, 1.0)
    solution = least_squares.solve(PLAIN, info.grams.sum(axis=0))
    spread = least_squares.uncertainty(PLAIN, solution, info)
    white = spread.density[0] * solution.inverse.diagonal()
    found = spread.covariance[0].diagonal()
    assert found[0] > 1.5 * white[0]
    assert found[1] < 0.85 * white[1]


def test_strength_is_that_of_the_first_stage() -> None:
    """One instrument that explains a share R^2 of its regressor: F = freedom R^2 / (1 - R^2)."""
    equations = normal_equations.normal_equations({"Cl": ("p",)}, layout(("p",)))
    rng = np.random.default_rng(8)
    lines = np.zeros((ROWS, equations.width))
    lines[:, equations.instruments[0]] = rng.normal(size=ROWS)
    lines[:, equations.columns[0]] = 0.8 * lines[:, equations.instruments[0]] + rng.normal(size=ROWS)
    lines[:, equations.outputs[0]] = lines[:, equations.columns[0]]
    info = information(np.pad(lines, ((0, 0), (0, 19 - equations.width))), 1.0)
    info.grams = info.grams[:, : equations.width, : equations.width]
    R2 = np.corrcoef(lines[:, equations.instruments[0]], lines[:, equations.columns[0]])[0, 1] ** 2
    found = least_squares.instrument_strength(equations, least_squares.solve(equations, info.grams.sum(axis=0)), info)
    assert found.strength[0] == pytest.approx(ROWS * R2 / (1.0 - R2), rel=0.05)
    assert normal_equations.with_strong_instruments(equations, np.array([100.0])) is equations
    assert normal_equations.with_strong_instruments(equations, np.array([3.0])).least_squares


@pytest.mark.parametrize("ratio", [0.8, 1.25])
def test_a_regressor_that_follows_its_instrument_more_than_expected_is_chance(ratio: float) -> None:
    """x = hold z: the variance is that of 1 / hold^2; what is less than that of z itself is luck."""
    lines, _ = made(INSTRUMENTAL, 4)
    columns, instruments = INSTRUMENTAL.columns, INSTRUMENTAL.instruments
    lines[:, columns] = ratio * lines[:, instruments]
    info = information(lines, 1.0)
    found = least_squares.instrument_strength(
        INSTRUMENTAL, least_squares.solve(INSTRUMENTAL, info.grams.sum(axis=0)), info
    )
    free = columns != instruments
    np.testing.assert_allclose(
        found.selection_factor[free & (INSTRUMENTAL.structure.group == INSTRUMENTAL.structure.block[5])],
        max(ratio, 1.0) ** 2,
    )
    assert (found.selection_factor >= 1.0).all()


def test_an_instrument_that_does_not_move_is_none() -> None:
    """As where the file believes that the controls do nothing."""
    lines, _ = made(INSTRUMENTAL, 2)
    lines[:, INSTRUMENTAL.instruments[0]] = 0.0
    info = information(lines, 1.0)
    found = least_squares.instrument_strength(
        INSTRUMENTAL, least_squares.solve(INSTRUMENTAL, info.grams.sum(axis=0)), info
    )
    assert found.strength[0] == 0.0
    assert (
        normal_equations.with_strong_instruments(INSTRUMENTAL, found.strength).instruments[0] == INSTRUMENTAL.columns[0]
    )


def test_weak_instruments_cost_their_block_alone() -> None:
    strength = np.full(INSTRUMENTAL.columns.size, 100.0)
    strength[INSTRUMENTAL.structure.unknowns(3)[0]] = 2.0
    mixed = normal_equations.with_strong_instruments(INSTRUMENTAL, strength)
    weak = INSTRUMENTAL.structure.group == INSTRUMENTAL.structure.block[3]
    np.testing.assert_array_equal(mixed.instruments[weak], INSTRUMENTAL.columns[weak])
    np.testing.assert_array_equal(mixed.instruments[~weak], INSTRUMENTAL.instruments[~weak])


def test_quantiles_are_students() -> None:
    freedom = np.array([1.0, 3.7, 30.0, 1e6])
    np.testing.assert_allclose(least_squares.student_95(freedom), student.ppf(0.975, freedom), rtol=1e-6)
    assert math.isfinite(least_squares.student_95(np.array([0.0]))[0])


def test_a_rival_is_the_regressor_that_moved_alike() -> None:
    lines, _ = made(PLAIN, 9)
    alpha, q, de = (PLAIN.columns[i] for i in PLAIN.structure.unknowns(0))
    lines[:, q] = lines[:, de] + 0.05 * lines[:, alpha] + 0.01 * np.random.default_rng(1).normal(size=ROWS)
    names = least_squares.most_correlated(PLAIN, least_squares.solve(PLAIN, lines.T @ lines))
    assert [PLAIN.structure.regressors[names[i]] for i in PLAIN.structure.unknowns(0)][1:] == ["de", "q"]


def test_a_density_that_is_rounding_has_no_standard_deviation() -> None:
    """Of the first samples after long gaps, where NumPy's warning had come onto the terminal of the node."""
    covariance, bands, freedom = np.zeros((2, 1, 1)), np.zeros((2, BANDS)), np.zeros(2)
    rounding = least_squares.Uncertainty(covariance, np.array([4.0, -1e-21]), bands, freedom)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert rounding.residual_std(0.5) == pytest.approx([2.0, math.nan], nan_ok=True)
