"""A set of candidates, fitted: what selection compares. And the sets that a stage of the selection fits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.predictive_density import Evidence


@dataclass(frozen=True)
class FittedSet:
    """A set of candidates fitted, with its evidence; ``added`` is the candidate that the smaller set lacked."""

    fit: CandidateFit
    evidence: Evidence
    added: Candidate | None = None

    @cached_property
    def deviance(self) -> float:
        """Minus twice the log posterior density, up to a constant that all sets of the same flights share."""
        return self.fit.deviance


class Stage(NamedTuple):
    """A stage of the forward selection, in which one candidate is added to explanations."""

    fitted: list[FittedSet]  # the larger explanations, the best first
    likely: list[Candidate]  # candidates that screening found likely, whether they were fitted or not
