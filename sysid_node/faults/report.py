"""The fault that a hypothesis describes, in words and numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.faults.hypotheses.bayes_factors import Weighed
from sysid_node.faults.hypotheses.catalogue import Hypothesis
from sysid_node.faults.model.terms import Terms
from sysid_node.faults.types import (
    AIRSPEED,
    DAMAGE,
    HARD_OVER,
    LOSS,
    SLOWER,
    STUCK,
    VANE_OFFSET,
    DerivativeChange,
    Fault,
)

Array = NDArray[np.float64]

WIDE = 1.96  # standard errors of a 95 % interval
AT_LIMIT = 0.9  # share of its travel, beyond which a stuck surface is hard over
SURE = 3.0  # standard errors, beyond which the change of a derivative is significant


class Detection(NamedTuple):
    """Times (s) of onset and alarm, and the probability among all hypotheses."""

    since: float
    found: float
    probability: float


def fault_of(hypothesis: Hypothesis, weighed: Weighed, terms: Terms, found: Detection) -> Fault:
    """The fault of a hypothesis, with its estimated size."""
    kind, part, by = hypothesis.kind, hypothesis.part, np.array(hypothesis.measure)
    if kind == DAMAGE:
        changes = _changes(hypothesis, weighed, terms)
        return Fault(kind, part, math.nan, math.nan, math.nan, "", *found, changes)
    middle, wide = float(by @ weighed.size), WIDE * math.sqrt(float(by @ weighed.covariance @ by))
    ends = [_reported_size(kind, x) for x in (middle, middle - wide, middle + wide)]
    unit = {LOSS: "1", AIRSPEED: "1", SLOWER: "s"}.get(kind, "rad")
    if kind == STUCK and abs(middle) >= AT_LIMIT * hypothesis.limit:
        kind = HARD_OVER
    return Fault(kind, part, ends[0], min(ends[1:]), max(ends[1:]), unit, *found)


def _reported_size(kind: str, size: float) -> float:
    """The reported size: for an airspeed the relative error of its reading, for a vane the error of its reading."""
    if kind == AIRSPEED:
        return 1.0 / math.sqrt(max(1.0 + size, 0.01)) - 1.0
    return -size if kind == VANE_OFFSET else size


def _changes(hypothesis: Hypothesis, weighed: Weighed, terms: Terms) -> tuple[DerivativeChange, ...]:
    """The derivatives with a significant change, most significant first."""
    errors = np.sqrt(np.diag(weighed.covariance))
    which = np.flatnonzero(hypothesis.shift.free.any(axis=1))
    sureness = np.abs(weighed.size) / errors
    return tuple(
        DerivativeChange(terms.names[which[i]], float(size), float(size - WIDE * error), float(size + WIDE * error))
        for i in np.argsort(-sureness).tolist()
        for size, error in [(weighed.size[i], errors[i])]
        if sureness[i] > SURE
    )
