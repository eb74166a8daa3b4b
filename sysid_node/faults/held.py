"""The model that is held: the last good derivatives, and how well they are known.

They are the aircraft file's within its tolerances until the identifier's take their place; those count when they were
valid and have grown old enough to hold nothing of a fault that is only now found (modified sequential least squares
holds its estimates the same way: Ward, Monaco & Bodson, J. Guidance 21(6), 1998).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.faults.terms import Terms

Array = NDArray[np.float64]

RIPE = 10.0  # s


class Known(NamedTuple):
    """A derivative as the identifier has it."""

    value: float
    standard_error: float
    valid: bool


@dataclass
class Held:
    """Values (D,) and standard errors (D,), what of them is to come, and the means that go with them."""

    terms: Terms
    values: Array
    errors: Array
    regressors: Array  # (D,) mean of each term's regressor of late
    offsets: Array = field(default_factory=lambda: np.zeros(6))  # k times these belong to the model, too
    coming: deque[tuple[float, Mapping[str, Known]]] = field(default_factory=deque)


def init(terms: Terms) -> Held:
    """The aircraft file's."""
    return Held(terms, terms.values.copy(), terms.tolerance.copy(), np.zeros(len(terms.names)))


def hear(held: Held, time: float, known: Mapping[str, Known]) -> None:
    """Estimates of a time (s); one a second is enough."""
    if held.coming and time < held.coming[-1][0]:
        held.coming.clear()  # the clock has stepped back
    if not held.coming or time - held.coming[-1][0] >= 1.0:
        held.coming.append((time, known))


def ripen(held: Held, now: float) -> None:
    """Take up what is old enough, where nothing has failed by a time (s)."""
    while held.coming and now - held.coming[0][0] >= RIPE:
        _, known = held.coming.popleft()
        for d, name in enumerate(held.terms.names):
            one = known.get(name)
            if one is not None and one.valid and math.isfinite(one.value + one.standard_error):
                held.offsets[held.terms.output[d]] -= (one.value - held.values[d]) * held.regressors[d]
                held.values[d], held.errors[d] = one.value, one.standard_error


def whole(held: Held) -> Array:
    """(D,) the values, with what the offsets have been found to be."""
    values = held.values.copy()
    for output in set(held.terms.output.tolist()):
        values[held.terms.offset_of(output)] += held.offsets[output]
    return values


def precision(held: Held, slack: float) -> Array:
    """(D,) 1 / variance of the held values; a share ``slack`` of each counts as no change."""
    terms = held.terms
    errors = np.hypot(held.errors, slack * np.abs(held.values))
    for output in set(terms.output.tolist()):
        mine = terms.output == output
        d = terms.offset_of(output)
        # offsets are learned in flight: they are off by what the other terms' slack makes of the motion
        errors[d] = math.sqrt(float(((slack * held.values * terms.signal)[mine] ** 2).sum())) + 1e-6
    return np.asarray(1.0 / np.maximum(errors, 1e-9) ** 2)
