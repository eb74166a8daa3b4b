"""Probabilities from scores: sure where every group agrees, not where one group decides."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import unfitted, with_candidates
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import HeldOutFlight, nuisances_of
from sysid_node.gap.estimation.predictive_density import (
    can_be_divided,
    cross_validated_evidence,
    held_out_evidence,
    noise_levels,
    probabilities,
    whole_flight_evidence,
)


def test_equal_scores_share() -> None:
    assert probabilities([np.zeros(6), np.zeros(6)]) == pytest.approx([0.5, 0.5])


def test_all_groups_agreeing_is_sure() -> None:
    assert probabilities([np.full(6, 5.0), np.zeros(6)])[0] > 0.99


def test_one_group_alone_is_not_sure() -> None:
    scores = np.array([9.0, -1.0, -1.0, -1.0, -1.0, -1.0])
    plain = 1.0 / (1.0 + np.exp(-scores.sum()))
    assert probabilities([scores, np.zeros(6)])[0] < plain - 0.1


def test_what_is_flown_is_what_is_written(plain_model) -> None:
    """Truth: corrected.yaml, which holds derivatives and neither biases nor clocks, though the fit has found some."""
    nuisances = nuisances_of(plain_model.simulator.aircraft, plain_model)
    fit = converged(unfitted([plain_model], nuisances), rounds=1)
    others = [i for i, (effect, _) in enumerate(plain_model.simulator.parameters) if effect != "derivative_error"]
    neutral = plain_model.simulator.neutral()
    assert np.any(fit.flights[0].point[others] != neutral[others])
    for evidence in (cross_validated_evidence(fit), held_out_evidence(fit, [HeldOutFlight(plain_model, nuisances)])):
        for point in evidence.flights[0].points:
            np.testing.assert_array_equal(point[others], neutral[others])
            assert np.any(point != neutral)


def test_a_flight_whose_commands_rest_but_for_one_part_is_not_divided(plain_model) -> None:
    assert can_be_divided([plain_model])
    commands = np.array(plain_model.inputs.signals.commands)
    commands[commands.shape[0] // 3 :] = commands[0]
    signals = plain_model.inputs.signals._replace(commands=jnp.asarray(commands))
    once = replace(plain_model, inputs=plain_model.inputs._replace(signals=signals))
    assert not can_be_divided([once])


def test_the_evidence_of_a_whole_flight_is_the_integral_of_likelihood_and_prior(plain_model) -> None:
    """Truth: near its maximum the posterior is Gaussian; halving a prior's width where it is sure gains ln 2."""
    nuisances = nuisances_of(plain_model.simulator.aircraft, plain_model)
    fit = converged(unfitted([plain_model], nuisances), rounds=1)
    narrow = replace(nuisances, sigma=0.5 * nuisances.sigma)
    flights = tuple(replace(flight, nuisances=narrow) for flight in fit.flights)
    other = replace(fit, flights=flights)
    sharper = replace(other, information=fit.information + other.prior_information - fit.prior_information)
    wide, sharp = whole_flight_evidence(fit), whole_flight_evidence(sharper)
    free = int(fit.uncertain.sum())
    gained = 0.5 * (np.linalg.slogdet(sharper.information)[1] - np.linalg.slogdet(fit.information)[1])
    assert sharp.total - wide.total == pytest.approx(
        free * np.log(2.0) - gained + other.prior_score - fit.prior_score, abs=1e-6
    )
    assert np.ptp(wide.scores) == 0.0
    np.testing.assert_array_equal(wide.flights[0].residual, fit.flights[0].residual)


def test_the_noise_of_a_flight_not_fitted_is_estimated_by_channel() -> None:
    """Truth: the power of rows drawn with powers 1, 25 on one of twelve channels, 0.01 on another; one unknown moved.

    What the unknown accounts for is no noise, and no noise is smaller than that of the fit.
    """
    random = np.random.default_rng(0)
    power = np.ones(12)
    power[[3, 5]] = 25.0, 0.01
    rows = np.sqrt(0.5 * power) * random.standard_normal((4, 200, 12))
    slopes = np.zeros((4, 200, 12, 1))
    slopes[..., 7, 0] = random.standard_normal((4, 200))
    rows[..., 7] += 30.0 * slopes[..., 7, 0]
    levels = noise_levels(rows.reshape(4, -1), slopes.reshape(4, -1, 1), np.array([[1e-4]]), np.zeros(12))
    assert levels[3] == pytest.approx(2.0 * np.mean(rows[..., 3] ** 2))
    assert levels[5] == 1.0
    assert np.delete(levels, 3) == pytest.approx(1.0, abs=0.15)
    known = noise_levels(rows.reshape(4, -1), slopes.reshape(4, -1, 1), np.array([[1e9]]), np.zeros(12))
    assert known[7] > 500.0  # an unknown that the fit knows does not move


def test_a_prior_that_a_candidate_widens_is_as_one_that_the_file_states(plain_model) -> None:
    """Truth: the evidence of a flight is the same where the file states tolerances of that width."""
    simulator = plain_model.simulator
    nuisances = nuisances_of(simulator.aircraft, plain_model)
    whole = next(c for c in candidates_of(simulator, [plain_model]) if c.label == "derivative_error of Cm")
    blamed = converged(with_candidates(unfitted([plain_model], nuisances), [whole], nuisances, ()), rounds=1)
    assert blamed.uncertain.all()
    stated = replace(blamed.nuisances, widened=0.0)
    filed = replace(blamed, candidates=(), flights=tuple(replace(f, nuisances=stated) for f in blamed.flights))
    evidence = [whole_flight_evidence(fit).total for fit in (blamed, filed)]
    assert evidence[0] == pytest.approx(evidence[1] - whole.log_choices, abs=1e-6)
