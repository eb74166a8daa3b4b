"""Probabilities from scores: sure where every group agrees, not where one group decides."""

import numpy as np
import pytest

from sysid_node.gap.estimation.candidate_fit import unfitted
from sysid_node.gap.estimation.convergence import converged
from sysid_node.gap.estimation.nuisances import HeldOutFlight, nuisances_of
from sysid_node.gap.estimation.predictive_density import cross_validated_evidence, held_out_evidence, probabilities


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
