"""A set of candidates, fitted: what selection compares."""

from __future__ import annotations

from dataclasses import dataclass

from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.predictive_density import Evidence


@dataclass(frozen=True)
class FittedSet:
    """A set of candidates fitted, with its evidence; ``added`` is the candidate that the smaller set lacked."""

    fit: CandidateFit
    evidence: Evidence
    added: Candidate | None = None
