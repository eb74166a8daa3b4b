"""What can be said of an estimate, as small numbers: statuses are decided as arrays, words are for those who read them.

A status is an index into ``Vocabulary.words``. The first few are the same for all aircraft; which regressor one is
collinear with, and which control is not on time, comes after them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.regression.normal_equations import ModelStructure

Codes = NDArray[np.uint8]

WORDS = (
    "ok",
    "converging",
    "outside model",
    "not excited",
    "contradicted",
    "changed",
    "stale input",
    "thrust not measured",
    "inertia unknown",
    "flow angle not measured",
    "gusts hide alpha",
    "gusts hide beta",
    "surfaces answer gusts",
)
OK, CONVERGING, OUTSIDE, NOT_EXCITED, CONTRADICTED, CHANGED, STALE, THRUST, INERTIA = range(9)


@dataclass(frozen=True)
class Vocabulary:
    """The words for all statuses that the estimates of one aircraft can have."""

    words: tuple[str, ...]
    collinear: int  # status of what is collinear with the first unknown's regressor; the others' follow

    def code(self, word: str) -> int:
        """The status that is called so."""
        return self.words.index(word)

    def texts(self, codes: NDArray[Any]) -> tuple[str, ...]:
        """(D,) statuses in words."""
        return tuple([self.words[code] for code in codes.tolist()])


def vocabulary(aircraft: Aircraft, structure: ModelStructure) -> Vocabulary:
    """The words for the estimates of a model of this ``structure``."""
    collinear = (f"collinear with {regressor}" for regressor in structure.regressors)
    late = (f"{control} not on time" for control in aircraft.control_symbols)
    return Vocabulary((*WORDS, *collinear, *late), len(WORDS))
