"""Scores without the bias of many instruments. Truth: Monte Carlo, with the imperfection that made the residuals."""

from __future__ import annotations

import numpy as np

from sysid_node.online.systematic.many_instruments import EquationSums, Scores

ROWS, INSTRUMENTS, RUNS = 200, 20, 300
TRUE = 0.7


def drawn(random: np.random.Generator, answered: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Instruments (ROWS, INSTRUMENTS), a sensitivity and a residual (ROWS,) whose noise is correlated with it.

    ``answered``: the correlation of each instrument with the sensitivity's noise.
    """
    noise = random.standard_normal((ROWS, 2))
    on_purpose = random.standard_normal((ROWS, INSTRUMENTS))
    instruments = on_purpose + answered * noise[:, :1]
    residual_noise = 0.8 * noise[:, 0] + 0.6 * noise[:, 1]
    sensitivity = on_purpose @ np.resize([0.15, -0.15], INSTRUMENTS) + noise[:, 0]
    return instruments, sensitivity, residual_noise - sensitivity * TRUE


def sums(instruments: np.ndarray, sensitivity: np.ndarray, residual: np.ndarray) -> EquationSums:
    """Of one equation."""
    both = np.column_stack([sensitivity, residual])
    q = np.linalg.qr(instruments)[0].T @ both
    return EquationSums(q.T @ q, both.T @ both, INSTRUMENTS, ROWS, 1.0, 1.0)


def estimate(of_one: EquationSums, share: float) -> tuple[float, float]:
    """The imperfection, and the flight's information about it."""
    scores = Scores.none(1)
    scores.add(of_one, share)
    information, score = scores.weighed()
    return -score[0] / information[0, 0], information[0, 0]


def bias(answered: float, *, measured: bool) -> float:
    """Mean error of the estimate over all runs."""
    random, found = np.random.default_rng(4), []
    for _ in range(RUNS):
        of_one = sums(*drawn(random, answered))
        last, _ = estimate(of_one, of_one.by_chance)
        for _ in range(4 if measured else 0):
            last, _ = estimate(of_one, of_one.share_taken_up(np.array([last])))
        found.append(last)
    return float(np.mean(found)) - TRUE


def test_instruments_that_answer_gusts_keep_more_of_them_and_the_residual_shows_how_much() -> None:
    """It shows less than is kept of both: two fifths of its noise are not in the sensitivity."""
    for answered in (0.08, 0.12):
        without, with_it = (bias(answered, measured=measured) for measured in (False, True))
        assert without < -0.1
        assert 0.85 * without < with_it < 0.0


def test_what_chance_may_explain_and_what_sensors_leave_keeps_nothing_more() -> None:
    """The residual's share is 0.15, by chance 0.1 +- 0.045; then 0.4, in gusts and in still air."""
    whole = np.diag([1.0, 1.0])
    for explained, gusts, least, most in ((0.15, 1.0, 0.1, 0.1), (0.4, 1.0, 0.35, 0.4), (0.4, 0.0, 0.1, 0.1)):
        of_one = EquationSums(np.diag([0.5, explained]), whole, 10, 100.0, gusts, 1.0)
        assert least <= of_one.share_taken_up(np.zeros(1)) <= most


def test_estimate_is_without_the_bias_of_two_stage_least_squares_and_its_error_is_the_scatter():
    random = np.random.default_rng(3)
    found, errors, two_stage = [], [], []
    for _ in range(RUNS):
        of_one = sums(*drawn(random))
        value, information = estimate(of_one, of_one.by_chance)
        found.append(value)
        errors.append(information**-0.5)
        # Nagar's score without what he subtracts
        instruments, sensitivity, residual = drawn(random)
        projected = np.linalg.qr(instruments)[0].T @ np.column_stack([sensitivity, residual])
        two_stage.append(-(projected[:, 0] @ projected[:, 1]) / (projected[:, 0] @ projected[:, 0]))
    scatter = np.std(found)
    assert abs(np.mean(found) - TRUE) < 0.25 * scatter
    assert abs(np.mean(two_stage) - TRUE) > 1.0 * np.std(two_stage)
    np.testing.assert_allclose(np.median(errors), scatter, rtol=0.2)


def test_what_the_flight_tells_less_of_than_the_tolerance_does_is_left_to_the_tolerance():
    scores = Scores.none(2)
    projected = np.array([[4.0, 0.0, -2.0], [0.0, 0.5, -0.4]])
    whole = np.vstack([projected, np.zeros(3)])
    scores.add(EquationSums(whole, whole, 0, 1.0, 1.0, 1.0), 0.0)
    information, score = scores.weighed()
    np.testing.assert_allclose(information, [[4.0, 0.0], [0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(score, [-2.0, 0.0], atol=1e-12)


def test_an_equation_whose_noise_is_taken_up_entirely_tells_nothing():
    scores = Scores.none(1)
    of_one = EquationSums(
        np.array([[4.0, -2.0], [-2.0, 2.0]]), np.array([[5.0, -3.0], [-3.0, 2.0]]), 1, 200.0, 1.0, 1.0
    )
    scores.add(of_one, of_one.share_taken_up(np.zeros(1)))
    information, score = scores.weighed()
    assert not information.any()
    assert not score.any()
