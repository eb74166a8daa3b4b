"""Probabilities from scores: sure where every group agrees, not where one group decides."""

import numpy as np
import pytest

from sysid_node.gap.evidence import probabilities


def test_equal_scores_share() -> None:
    assert probabilities([np.zeros(6), np.zeros(6)]) == pytest.approx([0.5, 0.5])


def test_all_groups_agreeing_is_sure() -> None:
    assert probabilities([np.full(6, 5.0), np.zeros(6)])[0] > 0.99


def test_one_group_alone_is_not_sure() -> None:
    scores = np.array([9.0, -1.0, -1.0, -1.0, -1.0, -1.0])
    plain = 1.0 / (1.0 + np.exp(-scores.sum()))
    assert probabilities([scores, np.zeros(6)])[0] < plain - 0.1
