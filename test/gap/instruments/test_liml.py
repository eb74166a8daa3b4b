"""Sizes that neither gusts nor chance bias; truth: Monte Carlo of equations with many instruments, and still air."""

import numpy as np

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import nuisances_of
from sysid_node.gap.instruments.liml import channel_products, liml_estimate, without_chance
from sysid_node.gap.instruments.moment_equations import FlightMoments, MomentEquations

ROWS, INSTRUMENTS, DRAWS = 400, 60, 200
TRUTH = 1.0


def drawn(random: np.random.Generator) -> MomentEquations:
    """One channel: a slope that the instruments foretell by a fifth; gusts move it and the remainder alike."""
    instruments = np.linalg.qr(random.standard_normal((ROWS, INSTRUMENTS)))[0]
    gusts = random.standard_normal(ROWS)
    slope = instruments @ random.standard_normal(INSTRUMENTS) * 1.1 + gusts
    remainder = TRUTH * slope + 0.8 * gusts + 0.6 * random.standard_normal(ROWS)
    along = instruments.T @ slope
    information, right = np.array([[1e-6 + along @ along]]), np.array([along @ (instruments.T @ remainder)])
    rows, slopes = remainder.reshape(1, ROWS, 1), slope.reshape(1, ROWS, 1, 1)
    return MomentEquations([FlightMoments({0: instruments}, rows, slopes)], information, right, 0.0)


def solved(seen: MomentEquations) -> tuple[float, float]:
    """By two stages, and without what chance gives to them."""
    channels, two_stages = channel_products(seen), seen.right / seen.information[0]
    step = two_stages
    for _ in range(10):
        corrected = without_chance(seen, channels, step, np.array([1e-6]))
        step = corrected.right / corrected.information[0]
    return float(two_stages[0]), float(step[0])


def test_many_instruments_bias_two_stages_and_not_the_likelihood() -> None:
    """Bekker (1994): two stages err by about m / n of what least squares does, over the share foretold."""
    random = np.random.default_rng(5)
    found = np.array([solved(drawn(random)) for _ in range(DRAWS)]) - TRUTH
    error = found.std(axis=0) / np.sqrt(DRAWS)
    assert found[:, 0].mean() > 20.0 * error[0]
    assert abs(np.median(found[:, 1])) < 0.2 * found[:, 0].mean()


def test_in_still_air_least_squares_stands(plain_model) -> None:
    fit = converged(unfitted([plain_model], nuisances_of(plain_model.simulator.aircraft, plain_model)), rounds=1)
    assert liml_estimate(fit) is fit
