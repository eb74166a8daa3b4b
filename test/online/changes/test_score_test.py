"""Contradictions: F against plain least squares and against its distribution by Monte Carlo; changes found."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import fly, made_aircraft, multisteps
from scipy.stats import f as fisher

from sysid_node.online import estimator
from sysid_node.online.changes.detection import ChangeTests
from sysid_node.online.changes.score_test import UNSHARED, ReferenceEstimates, ScoreTest, disagreement, score_test
from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression import normal_equations, regressor_noise
from sysid_node.online.regression.gust_correlation import ANSWERED
from sysid_node.online.regression.information import BANDS, spectrum
from sysid_node.online.regression.least_squares import Solution, Uncertainty
from sysid_node.online.settings import METHODS, OnlineSettings
from sysid_node.online.state import EstimatorState

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft()
RATE, SECONDS, CHANGED_AT = 100.0, 22.0, 18.0
LAYOUT = SignalLayout(("alpha", "q", "de"), ("de",), ())
PLAN = normal_equations.normal_equations({"CL": ("0", "alpha", "de"), "Cm": ("0", "alpha", "q", "de")}, LAYOUT)
SPECTRUM = spectrum(2.0 * math.pi * np.arange(0.1, 2.0, 0.04), math.inf)
LINES = 2 * SPECTRUM.omega.size


def reference(theta: Array, covariance: Array, density: float = 1.0, freedom: float = 50.0) -> ReferenceEstimates:
    """Estimates of one density in all bands."""
    C, P = PLAN.outputs.size, PLAN.columns.size
    solution = Solution(theta, np.eye(P), np.ones(C), np.ones(C), np.array(True))
    bands = np.full((C, BANDS), density)
    return ReferenceEstimates(0.0, PLAN, solution, Uncertainty(covariance, bands[:, 0], bands, np.full(C, freedom)))


def test_statistic_is_that_of_plain_least_squares() -> None:
    """Known theta, white noise: F = |X b|^2 / (p s^2), b the least-squares fit to the residuals."""
    rng = np.random.default_rng(0)
    lines, duration, density = rng.normal(size=(LINES, PLAN.width)), 500.0, 3.0
    P, C = PLAN.columns.size, PLAN.outputs.size
    theta = rng.normal(size=(P, C)) * PLAN.structure.belongs
    found = score_test(reference(theta, np.zeros((C, P, P)), density), lines, SPECTRUM, duration)
    for c in range(C):
        unknowns = PLAN.structure.unknowns(c)
        X = lines[:, PLAN.columns[unknowns]]
        r = lines[:, PLAN.outputs[c]] - X @ theta[unknowns, c]
        fit = X @ np.linalg.lstsq(X, r, rcond=None)[0]
        # long enough for the stretch itself to look quiet beside the usual density
        F = float(fit @ fit) / (unknowns.size * density * 0.5 / 0.04)
        assert found.statistic[c] == pytest.approx(F, rel=1e-6)
        assert found.chance(1.0)[c] == pytest.approx(fisher.sf(F, unknowns.size, 50.0), rel=1e-6)
        rest = float(r @ r - fit @ fit) / float(np.square(lines[:, PLAN.outputs[c]]).sum())
        assert found.share[c] == pytest.approx(rest, rel=1e-6)


def test_uncertain_estimates_contradict_less() -> None:
    rng = np.random.default_rng(1)
    lines = rng.normal(size=(LINES, PLAN.width))
    P, C = PLAN.columns.size, PLAN.outputs.size
    covariances = [scale * np.tile(np.eye(P), (C, 1, 1)) for scale in (0.0, 1e-2, 1.0)]
    sure, less, hardly = (
        score_test(reference(np.zeros((P, C)), covariance, 1e-3), lines, SPECTRUM, 500.0).statistic
        for covariance in covariances
    )
    assert (sure > less).all()
    assert (less > hardly).all()


DENSITY, VARIANCE = 1e-3, 1e-4  # of the usual noise, and of each estimate


def nearly_known(rng: np.random.Generator) -> tuple[Array, ReferenceEstimates]:
    """Lines of noise, and estimates of zero with small errors."""
    P, C = PLAN.columns.size, PLAN.outputs.size
    covariance = VARIANCE * np.tile(np.eye(P), (C, 1, 1))
    return rng.normal(size=(LINES, PLAN.width)), reference(np.zeros((P, C)), covariance, DENSITY)


def test_errors_of_the_lines_and_gusts_that_controls_answer_contradict_less() -> None:
    """One error of each residual, alike in all lines: the score's covariance has its square, F as by hand."""
    rng = np.random.default_rng(2)
    lines, known = nearly_known(rng)
    C, theta, covariance = PLAN.outputs.size, known.solution.theta, known.uncertainty.covariance
    sure = score_test(known, lines, SPECTRUM, 500.0)
    errors = rng.normal(size=(C, LINES, 1))
    found = score_test(known, lines, SPECTRUM, 500.0, errors)
    assert (found.statistic < sure.statistic).all()
    for c in range(C):
        Z = lines[:, PLAN.columns[PLAN.structure.unknowns(c)]]
        score = Z.T @ lines[:, PLAN.outputs[c]]
        excess = max(float(sure.unexplained[c]), 1.0)
        spread = Z.T @ Z * DENSITY * excess * 0.5 / 0.04 + VARIANCE * (Z.T @ Z) @ (Z.T @ Z).T
        spread += np.outer(Z.T @ errors[c, :, 0], Z.T @ errors[c, :, 0])
        assert found.statistic[c] == pytest.approx(score @ np.linalg.solve(spread, score) / score.size, rel=1e-6)
    inflated = score_test(replace(known, inflation=np.full(C, 4.0)), lines, SPECTRUM, 500.0)
    wider = score_test(reference(theta, 4.0 * covariance, DENSITY), lines, SPECTRUM, 500.0)
    np.testing.assert_allclose(inflated.statistic, wider.statistic, rtol=1e-9)


def test_a_share_of_the_systematic_errors_contradicts_nothing() -> None:
    """As if a fifth of these errors were in the estimates' standard errors; without them F is larger."""
    lines, known = nearly_known(np.random.default_rng(6))
    theta, covariance = known.solution.theta, known.uncertainty.covariance
    off = replace(known, systematic=25.0 * covariance)
    found = score_test(off, lines, SPECTRUM, 500.0).statistic
    wider = score_test(reference(theta, 2.0 * covariance, DENSITY), lines, SPECTRUM, 500.0).statistic
    np.testing.assert_allclose(found, wider, rtol=1e-9)
    several = score_test(ReferenceEstimates.stacked([known, off]), np.array([lines, lines]), SPECTRUM, [500.0, 500.0])
    np.testing.assert_allclose(several.statistic[1], found, rtol=1e-9)
    assert (several.statistic[0] > found).all()


def test_the_noise_of_regressors_that_do_not_move_is_no_contradiction() -> None:
    """Nothing moves, alpha is noise: Z'r has the mean -theta times the noise's energy, by the noise's own density."""
    rng, duration, noise, slope = np.random.default_rng(5), 25.0, 0.3, 4.0
    lines = math.sqrt(1e-6 * duration / 2.0) * rng.normal(size=(LINES, PLAN.width))
    alpha = LAYOUT.column("alpha")
    lines[:, alpha] = math.sqrt(noise * duration / 2.0) * rng.normal(size=LINES)
    P, C = PLAN.columns.size, PLAN.outputs.size
    theta = np.where(PLAN.columns == alpha, slope, 0.0)[:, None] * PLAN.structure.belongs
    known = reference(theta, np.zeros((C, P, P)), noise * slope**2, 200.0)
    bias = np.zeros((PLAN.width, PLAN.width))
    bias[alpha, alpha] = noise
    freed = replace(known, noise_score=regressor_noise.noise_score(PLAN, known.solution, bias))
    before, after = (score_test(each, lines, SPECTRUM, duration).chance(1.0) for each in (known, freed))
    assert (before < 1e-6).all() and (after > 0.05).all()
    shifted = lines.copy()
    shifted[:, PLAN.outputs] += 20.0 * lines[:, [alpha]]  # what noise cannot do: the score has the other sign
    assert (score_test(freed, shifted, SPECTRUM, duration).chance(1.0) < 1e-6).all()


def test_a_stretch_in_which_surfaces_only_answer_gusts_contradicts_less() -> None:
    """The pitching moment's score may be correlated with gusts. Nothing is known of lift: its regressors are others."""
    rng, duration = np.random.default_rng(8), 12.0
    lines, P, C = rng.normal(size=(LINES, PLAN.width)), PLAN.columns.size, PLAN.outputs.size
    lines[:, LAYOUT.column("de")] *= 2.0
    theta = np.where(PLAN.columns == LAYOUT.column("de"), -0.6, 0.0)[:, None] * PLAN.structure.belongs
    exact = reference(theta, np.zeros((C, P, P)), DENSITY)
    told = replace(exact, sensed=np.zeros(C))
    before, after = (score_test(one, lines, SPECTRUM, duration) for one in (exact, told))
    lift, moment = PLAN.structure.coefficients.index("CL"), PLAN.structure.coefficients.index("Cm")
    energy = 0.5 * LINES * duration
    gusts = float(before.unexplained[moment]) * DENSITY * energy
    assert before.unexplained[moment] > 1.0  # rougher than usual
    ratio = gusts / (0.6**2 * float(np.square(lines[:, LAYOUT.column("de")]).sum()))
    factor = 1.0 + (UNSHARED * ANSWERED) ** 2 * ratio * energy * 0.04 / 0.5
    assert (UNSHARED * ANSWERED) ** 2 * ratio < 1.0
    assert before.statistic[moment] / after.statistic[moment] == pytest.approx(factor, rel=1e-6)
    assert after.statistic[lift] == pytest.approx(before.statistic[lift])
    sensed = replace(exact, sensed=np.full(C, 1e6))  # what the sensors' noise explains is no gust
    np.testing.assert_allclose(score_test(sensed, lines, SPECTRUM, duration).statistic, before.statistic)
    several = ReferenceEstimates.stacked([exact, told])
    both = score_test(several, np.array([lines, lines]), SPECTRUM, [duration, duration])
    np.testing.assert_allclose(both.statistic, [before.statistic, after.statistic])


def test_what_an_error_of_a_servos_time_explains_is_no_contradiction() -> None:
    """de is 5 ms later than its lines have it, and alpha is its slope: one standard error makes a score of one."""
    rng, late, de = np.random.default_rng(3), 0.005, LAYOUT.column("de")
    lines, P, C = rng.normal(size=(LINES, PLAN.width)), PLAN.columns.size, PLAN.outputs.size
    theta = np.ones((P, C)) * PLAN.structure.belongs
    transform = lines[: LINES // 2, de] + 1j * lines[LINES // 2 :, de]
    slope, later = -1j * SPECTRUM.omega * transform, np.exp(-1j * SPECTRUM.omega * late) * transform
    lines[:, LAYOUT.column("alpha")] = np.concatenate([slope.real, slope.imag])
    flown = lines.copy()
    flown[:, de] = np.concatenate([later.real, later.imag])
    lines[:, PLAN.outputs] = flown[:, PLAN.columns] @ theta
    exact = reference(theta, np.zeros((C, P, P)), density=1e-4)
    told = replace(exact, time_errors=np.where(PLAN.columns == de, late, 0.0))
    count = PLAN.structure.belongs.sum(axis=0)
    before, after = (score_test(one, lines, SPECTRUM, 500.0).statistic * count for one in (exact, told))
    assert before.min() > 50.0
    assert after.max() < 1.1


def test_disagreement_is_the_chance_of_the_difference() -> None:
    """One derivative each differs by d, of variance v on both sides: F = d^2 / (2 v p)."""
    P, C = PLAN.columns.size, PLAN.outputs.size
    covariance = np.tile(0.5 * np.eye(P), (C, 1, 1))
    shift = np.zeros((P, C))
    shift[PLAN.structure.unknowns(1)[0], 1] = 3.0
    chance = disagreement(reference(shift, covariance), reference(np.zeros((P, C)), covariance, freedom=30.0))
    assert chance[0] == pytest.approx(1.0)
    assert chance[1] == pytest.approx(fisher.sf(9.0 / 3, 3, 30.0), rel=1e-6)


def flown(samples: Array, time: Array, method: str) -> EstimatorState:
    state = estimator.init(AIRCRAFT, OnlineSettings(method=method, detect_changes=False))
    for t, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, t, sample)
    return state


def looked(state: EstimatorState, span: int) -> ScoreTest:
    model = state.model
    tests = ChangeTests(
        model.equations, model.instrument_model, model.spectrum, state.changes.monitor, state.transform.last, math.inf
    )
    found = next((found for _, found in tests.contradictions([span])), None)
    assert found is not None
    return found


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_nothing_is_unlikely_where_nothing_has_changed(method: str) -> None:
    """Gusts of 0.7 m/s, autopilot: of 60 chances no more than a fifth are under a tenth, none under 1e-4."""
    time, flights = fly(AIRCRAFT, multisteps(SECONDS, RATE), RATE, 5, seed=4, gusts=0.7)
    states = [flown(samples, time, method) for samples in flights]
    chances = np.array([[looked(state, span).chance(1.0) for span in (6, 12)] for state in states])
    assert (chances < 0.1).mean() < 0.2
    assert np.median(chances) < 0.9
    assert chances.min() > 1e-4


@pytest.mark.parametrize("method", METHODS)
def test_half_a_surface_lost_contradicts_its_own_equation(method: str) -> None:
    after = (CHANGED_AT, {"Cl_da": 0.5})
    time, flights = fly(AIRCRAFT, multisteps(SECONDS, RATE), RATE, 1, seed=4, gusts=0.7, after=after)
    for samples in flights:
        state = flown(samples, time, method)
        chance = dict(zip(state.equations.structure.coefficients, looked(state, 7).chance(1.0), strict=True))
        assert chance["Cl"] < 1e-6
        assert chance["Cm"] > 1e-3
