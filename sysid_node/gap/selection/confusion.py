"""What is confused with what: how alike two explanations are on a flight, once the nuisances have done theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.estimation.spectral_weights import real_rows
from sysid_node.gap.selection.candidate_fitter import FittedSet


@dataclass(frozen=True)
class Confusion:
    """Explanations tried alone, the best first, and the cosines (K, K) between what they take away."""

    labels: tuple[str, ...]
    cosines: Array


def confusion_of(base: FittedSet, trials: Sequence[FittedSet]) -> Confusion:
    """One: the two change the simulated flight in the same way, and no data of this flight part them."""
    left = _rows(base.fit, base.fit)
    taken = [left - _rows(trial.fit, base.fit) for trial in trials]
    table = np.stack([t / max(float(np.linalg.norm(t)), 1e-300) for t in taken])
    return Confusion(tuple(t.added.label for t in trials if t.added), table @ table.T)


def _rows(fit: CandidateFit, like: CandidateFit) -> Array:
    """What a fit leaves, weighted as another's remainder."""
    pieces = [
        real_rows(flight.residual, weighted.weights).ravel()
        for flight, weighted in zip(fit.flights, like.flights, strict=True)
    ]
    return np.concatenate(pieces)
