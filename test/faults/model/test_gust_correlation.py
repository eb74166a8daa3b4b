"""What gusts may have taught: the shift that a correlation makes in least squares, and a flight in which it matters."""

import numpy as np
import pytest
from fault_flights import fly, monitored
from scipy.stats import chi2

from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.hypotheses.bayes_factors import Shift, Shifts, marginal, score_squares
from sysid_node.faults.hypotheses.weighing import allowing_for_gusts, last_interval
from sysid_node.faults.model import gust_correlation
from sysid_node.faults.model.gust_correlation import ALIKE, BY_CHANCE, CORRELATION
from sysid_node.faults.state import MonitorState

BLOCKS = 500.0
RARE = float(chi2.ppf(0.999, 3))  # sum of three squares


def taught(seed: int = 1) -> tuple[MonitorState, np.ndarray, np.ndarray]:
    """A monitor that has learned Cm's slopes, which ones, and what a block said of all terms, in the mean."""
    state, _ = monitored(seed)
    held = state.reference
    slopes = np.flatnonzero((state.terms.output == COEFFICIENTS.index("Cm")) & ~state.terms.of("0"))
    X = np.random.default_rng(seed).standard_normal((40, len(slopes)))
    said = np.zeros_like(held.J)
    said[np.ix_(slopes, slopes)] = X.T @ X
    held.J, held.blocks = BLOCKS * said, BLOCKS * (said != 0.0)
    held.regressors = np.random.default_rng(seed).standard_normal(held.regressors.size)
    return state, slopes, said


def test_a_stretch_that_is_moved_alike_is_shifted_alike() -> None:
    state, _, said = taught()
    for times in (0.01, 1.0, 0.99 * ALIKE):
        np.testing.assert_allclose(gust_correlation.gust_covariance(state.reference, times * said), 0.0, atol=1e-12)


def test_the_shift_is_the_correlation_s_however_long_was_learned() -> None:
    """With e = rho y for a y that the regressors explain, least squares are off by rho standard errors of one block."""
    state, slopes, said = taught()
    allowed = gust_correlation.gust_covariance(state.reference, 1e6 * said)[np.ix_(slopes, slopes)]
    block = np.linalg.inv(said[np.ix_(slopes, slopes)])
    np.testing.assert_allclose(allowed, CORRELATION**2 * block, rtol=1e-4)
    state.reference.J, state.reference.blocks = 10.0 * state.reference.J, 10.0 * state.reference.blocks
    doubt = gust_correlation.gust_covariance(state.reference, 1e6 * said)[np.ix_(slopes, slopes)]
    np.testing.assert_allclose(doubt, allowed, rtol=1e-9)


def test_the_shift_leaves_the_mean_as_it_is() -> None:
    state, slopes, said = taught()
    allowed = gust_correlation.gust_covariance(state.reference, 1e3 * said)
    mean = np.zeros(len(allowed))
    mean[slopes] = state.reference.regressors[slopes]
    mean[state.terms.offset_of(COEFFICIENTS.index("Cm"))] = 1.0
    assert np.abs(allowed).max() > 1e-4
    assert mean @ allowed @ mean == pytest.approx(0.0, abs=1e-9 * np.abs(allowed).max())


def test_another_mean_motion_makes_an_offset_of_the_slopes_bias() -> None:
    """Residuals of unit variance that correlate with the regressors, in any direction alike, shift the slopes."""
    state, slopes, said = taught()
    away = np.array([0.2, -0.1, 0.3])
    mean = state.reference.regressors.copy()
    mean[slopes] += away
    u = np.random.default_rng(3).standard_normal((20000, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    root = np.linalg.cholesky(np.linalg.inv(said[np.ix_(slopes, slopes)]))
    offsets = CORRELATION * u @ root.T @ away
    found = gust_correlation.offset_covariance(state.reference, mean)
    place = state.terms.offset_of(COEFFICIENTS.index("Cm"))
    assert found[place, place] == pytest.approx(np.mean(offsets**2), rel=0.03)
    found[place, place] = 0.0
    np.testing.assert_array_equal(found, 0.0)
    usual = gust_correlation.offset_covariance(state.reference, state.reference.regressors)
    np.testing.assert_array_equal(usual, 0.0)


def test_what_was_never_learned_is_not_doubted() -> None:
    state, _ = monitored(2)
    assert not gust_correlation.gust_covariance(state.reference, np.eye(len(state.terms.names))).any()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_burst_against_what_gusts_have_taught_proves_nothing(seed: int) -> None:
    """A minute has taught the slopes of Cm wrongly, by a correlation of 0.8; a burst that says the truth follows."""
    state, maker = monitored(seed)
    state.reference.errors = 0.3 * np.abs(state.reference.values) + 1e-5
    fly(state, maker, 60.0)
    slopes = np.flatnonzero((state.terms.output == COEFFICIENTS.index("Cm")) & ~state.terms.of("0"))
    said = state.reference.J / np.maximum(state.reference.blocks, 1.0)
    plain = state.terms.derivatives
    root = np.linalg.cholesky(np.linalg.inv(said[np.ix_(plain, plain)])[np.ix_(slopes, slopes)])
    off = np.zeros(len(said))
    off[slopes] = 0.8 * root @ (np.array([1.0, -1.0, 1.0]) / np.sqrt(3.0))
    over = last_interval(state, 10)
    for times, excused in ((1.0, False), (30.0, True)):
        J = 100.0 * times * said  # of many blocks, so that only what is believed leaves anything open
        burst = over._replace(whole=(J, J @ off))
        before = marginal(*burst.whole, over.prior.precision)
        after = allowing_for_gusts(state, burst._replace(pieces=100 * over.pieces[:1]))
        surprise = [float(v @ np.linalg.pinv(J) @ v) for J, v in (before, (after.J, after.v))]
        assert surprise[0] > RARE
        assert surprise[1] < RARE if excused else surprise[1] == pytest.approx(surprise[0]), surprise


def test_what_gusts_in_a_row_do_to_many_directions() -> None:
    """The mean square of the score of residuals that go with the regressors by ``BY_CHANCE``, in 2,000 stretches."""
    random, blocks, terms = np.random.default_rng(7), 80, 4
    axis = Shift(np.zeros(terms), np.eye(terms), np.ones(terms))
    shifts = Shifts([Shift(np.zeros(terms), np.eye(terms)[:, :1], np.ones(1)), axis])
    squares = []
    for _ in range(2000):
        X = random.standard_normal((blocks, terms))
        y = BY_CHANCE * X.sum(axis=1) + random.standard_normal(blocks)
        squares.append(score_squares(X.T @ X, X.T @ y, shifts)[1])
    whole = np.array([False, True])
    allowed = gust_correlation.usual_size_in_gusts(whole, np.array([0.5, 0.5]), blocks)
    assert allowed[0] == 1.0  # a single direction: no more than chance makes
    assert allowed[1] == pytest.approx(np.mean(squares), rel=0.05)
    np.testing.assert_array_equal(gust_correlation.usual_size_in_gusts(whole, np.array([3.0, 4.0]), blocks), [3.0, 4.0])
