"""Information from well-excited flight: the finished segments in which the controls moved most.

In quiet flight the surfaces only answer the motion that gusts cause, and an autopilot's answers are correlated with the
gusts: estimates from long quiet flight are biased, and the next manoeuvre contradicts them though nothing has changed
(Soderstrom & Stoica, "System Identification", 1989, ch. 10, on feedback without external excitation). An aircraft has
changed only if it contradicts its own earlier manoeuvres, too.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.changes.score_test import ReferenceEstimates
from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression import least_squares, normal_equations
from sysid_node.online.regression.information import Information
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]

COMPARABLE = 0.3  # share of the largest energy of a control from which a segment counts
KEPT = 12  # segments remembered


@dataclass(frozen=True)
class ExcitedSegment:
    """One finished segment."""

    end: float  # s
    energy: Array  # of each control
    information: Information


@dataclass
class ExcitedSegments:
    """Of one block of equations: the last segments in which any of its controls moved much."""

    controls: NDArray[np.intp]  # columns of the block's controls
    segments: deque[ExcitedSegment] = field(default_factory=lambda: deque(maxlen=KEPT))

    def peaks(self) -> Array:
        """(m,) the largest energy of each control in a segment."""
        return np.asarray(np.max([np.zeros(self.controls.size), *(s.energy for s in self.segments)], axis=0))

    def is_comparable(self, energy: Array) -> bool:
        """Whether a control's ``energy`` (m,) is comparable to its largest in the segments kept."""
        return bool((energy > COMPARABLE * self.peaks()).any())

    def exceeds_all(self, energy: Array) -> bool:
        """Whether a control's ``energy`` (m,) is far larger than in any of the segments kept."""
        return bool((COMPARABLE * energy > self.peaks()).any())


def no_excited_segments(equations: NormalEquations, layout: SignalLayout) -> list[ExcitedSegments]:
    """An empty collection for each block of the normal equations."""
    group = equations.structure.group
    blocks = (equations.columns[group == block] for block in range(int(group.max()) + 1))
    moved = np.arange(layout.width)[layout.deflections]
    return [ExcitedSegments(columns[np.isin(columns, moved)]) for columns in blocks]


def remember(known: Sequence[ExcitedSegments], information: Information, end: float) -> None:
    """Remember a segment that ended at ``end`` (s) where its controls moved much."""
    energies = information.grams.sum(axis=0).diagonal()
    for excited in known:
        energy = energies[excited.controls]
        if excited.is_comparable(energy):
            excited.segments.append(ExcitedSegment(end, energy, information))


def estimates_of(
    excited: ExcitedSegments, full: NormalEquations, since: float, before: float
) -> ReferenceEstimates | None:
    """The estimates by the well-excited segments that ended in ``since``..``before`` (s); None where there are none."""
    chosen = [s for s in excited.segments if since < s.end <= before + 1e-6 and excited.is_comparable(s.energy)]
    if not chosen:
        return None
    information = chosen[0].information
    for segment in chosen[1:]:
        information = information + segment.information
    gram = information.grams.sum(axis=0)
    instrument_strength = least_squares.instrument_strength(full, least_squares.solve(full, gram), information)
    equations = normal_equations.with_strong_instruments(full, instrument_strength.strength)
    solution = least_squares.solve(equations, gram)
    return ReferenceEstimates(
        chosen[-1].end, equations, solution, least_squares.uncertainty(equations, solution, information)
    )
