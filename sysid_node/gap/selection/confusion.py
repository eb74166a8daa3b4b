"""How similar the effects' responses are on a flight, after the nuisances were fitted: what may be confused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.spectral_weights import real_rows
from sysid_node.gap.selection.fitted_set import FittedSet


@dataclass(frozen=True)
class Confusion:
    """Candidates fitted alone, the best first, and the cosines (K, K) of the angles between what they remove."""

    labels: tuple[str, ...]
    cosines: Array


def confusion_of(base: FittedSet, fitted: Sequence[FittedSet]) -> Confusion:
    """The confusion of candidates fitted alone, against nuisances alone (``base``).

    A cosine of one says that two candidates change the prediction in the same way, so that this flight cannot tell
    them apart.
    """
    before = _weighted_residual(base.fit, base.fit)
    removed = [before - _weighted_residual(each.fit, base.fit) for each in fitted]
    table = np.stack([each / max(float(np.linalg.norm(each)), 1e-300) for each in removed])
    return Confusion(tuple(each.added.label for each in fitted if each.added), table @ table.T)


def _weighted_residual(fit: CandidateFit, like: CandidateFit) -> Array:
    """The residual (R,) of a fit with the weights of another."""
    pieces = [
        real_rows(flight.residual, weighted.weights).ravel()
        for flight, weighted in zip(fit.flights, like.flights, strict=True)
    ]
    return np.concatenate(pieces)
