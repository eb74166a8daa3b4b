"""The model that is held: the last good derivatives, and how well they are known.

They begin as the aircraft file's, within its tolerances; the identifier's take their place where they are valid and
have grown old enough to hold nothing of a fault that is only now found. On top comes what sound flight has shown since:
least squares of the whitened blocks, constrained to these values (modified sequential least squares: Ward, Monaco &
Bodson, J. Guidance 21(6), 1998), less what the vanes' noise adds to their motion's energy (bias-compensated least
squares: Soderstrom, Automatica 43, 2007, sec. 5).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.faults.model.residual_whitening import WhiteningFilter
from sysid_node.faults.model.terms import Terms
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]

RIPE = 10.0  # s
REAL = 0.5  # share of a direction's information that must be motion's
KEPT = 0.9995  # share of what a block has shown that the next one leaves: 200 s


class IdentifierEstimate(NamedTuple):
    """A derivative as the identifier has it."""

    value: float
    standard_error: float
    valid: bool


def identifier_estimates(estimates: Estimates) -> dict[str, IdentifierEstimate]:
    """What the identifier says, as the monitor hears it."""
    return {d.name: IdentifierEstimate(d.value, d.standard_error, d.valid) for d in estimates.derivatives.values()}


@dataclass
class ReferenceModel:
    """Values (D,) and standard errors (D,), what flight has shown on top, and the offsets that go with them."""

    terms: Terms
    values: Array
    errors: Array
    regressors: Array  # (D,) mean of each term's regressor of late
    J: Array  # (D, D) information of sound flight
    v: Array  # (D,) its score about the values
    blocks: Array  # (D, D) how many it is made of
    offsets: Array = field(default_factory=lambda: np.zeros(6))  # k times these belong to the model, too
    coming: deque[tuple[float, Mapping[str, IdentifierEstimate]]] = field(default_factory=deque)


class ModelPrior(NamedTuple):
    """What the blocks are weighed against: the mean's distance from the held values (D,), and its precision (D, D)."""

    shift: Array
    precision: Array


def init(terms: Terms) -> ReferenceModel:
    """The aircraft file's."""
    count = len(terms.names)
    nothing = np.zeros(count)
    none = np.zeros((count, count))
    return ReferenceModel(
        terms, terms.values.copy(), terms.tolerance.copy(), nothing, none, nothing.copy(), none.copy()
    )


def receive_estimates(held: ReferenceModel, time: float, known: Mapping[str, IdentifierEstimate]) -> None:
    """Estimates of a time (s); some of them are kept until they are ripe."""
    if held.coming and time < held.coming[-1][0]:
        held.coming.clear()  # the clock has stepped back
    if not held.coming or time - held.coming[-1][0] >= RIPE:
        held.coming.append((time, known))


def adopt_estimates(held: ReferenceModel, now: float) -> bool:
    """Take up what is old enough, where nothing has failed by a time (s); whether anything was."""
    taken = False
    while held.coming and now - held.coming[0][0] >= RIPE:
        _, known = held.coming.popleft()
        for d, name in enumerate(held.terms.names):
            one = known.get(name)
            if one is not None and one.valid and math.isfinite(one.value + one.standard_error):
                change = one.value - held.values[d]
                held.offsets[held.terms.output[d]] -= change * held.regressors[d]
                held.v -= change * held.J[:, d]
                held.values[d], held.errors[d] = one.value, one.standard_error
                taken = True
    return taken


def learn(held: ReferenceModel, J: Array, v: Array, chosen: NDArray[np.bool_]) -> None:
    """From a block of sound flight, about the ``chosen`` terms (D,)."""
    both = np.outer(chosen, chosen)
    held.blocks = KEPT * held.blocks + both
    held.J = KEPT * held.J + both * J
    held.v = KEPT * held.v + chosen * v


def noise_of(terms: Terms, colour: WhiteningFilter, regressor: str, variance: float) -> Array:
    """(D, D) what noise of a ``variance`` on a regressor adds to the information of a block."""
    noisy = np.flatnonzero(terms.of(regressor))
    design = np.zeros((6, len(terms.names)))
    design[terms.output[noisy], noisy] = np.sqrt(variance)
    parts = (colour.unmix @ (taps[:, None] * design) for taps in (np.ones(6), *colour.filter))
    return np.asarray(sum(part.T @ part for part in parts))


def model_prior(held: ReferenceModel, noise: Array, slack: float) -> ModelPrior:
    """What is held, with what sound flight has shown; a share ``slack`` of each derivative counts as no change.

    ``noise`` (D, D) is the part of the information that is the regressors' noise.
    """
    terms, values = held.terms, held.values
    root = np.linalg.cholesky(_covariance(held))
    size, axes = np.linalg.eigh(root.T @ (held.J - noise) @ root)
    axes = root @ axes
    # where the noise makes as much of the information as the motion, nothing is learned: it is not known that well
    learned = size > REAL * np.einsum("di,de,ei->i", axes, held.J, axes)
    size = np.where(learned, size, 0.0)
    covariance = (axes / (1.0 + size)) @ axes.T
    shift = axes @ np.where(learned, axes.T @ (held.v + noise @ values) / (1.0 + size), 0.0)
    values = values + shift
    loose = (slack * values) ** 2
    for output in set(terms.output.tolist()):
        mine = terms.output == output
        d = terms.offset_of(output)
        # offsets are learned by themselves, for the held values: what is shifted leaves the mean as it is
        mine[d] = False
        shift[d] = -float(shift[mine] @ held.regressors[mine])
        # and they are off by what the other terms' slack makes of the motion
        loose[d] = float(((slack * values * terms.signal)[mine] ** 2).sum()) + (slack * values[d]) ** 2 + 1e-12
    return ModelPrior(shift, np.asarray(np.linalg.inv(covariance + np.diag(loose)), dtype=np.float64))


def _covariance(held: ReferenceModel) -> Array:
    """(D, D) of the held values: each by itself, and as much again for what is common to a coefficient's.

    A wrong area, inertia or airspeed calibration scales all of a coefficient's derivatives alike.
    """
    terms, errors = held.terms, np.maximum(held.errors, 1e-9)
    found = np.diag(errors**2)
    for output in set(terms.output.tolist()):
        mine = (terms.output == output) & (terms.signal < 1.0)
        share = float(np.median(errors[mine] / np.maximum(np.abs(held.values[mine]), 1e-9))) if mine.any() else 0.0
        common = np.where(terms.output == output, min(share, 1.0) * held.values, 0.0)
        found += np.outer(common, common)
    return found


def whole(held: ReferenceModel, shift: Array) -> Array:
    """(D,) the values with a ``shift``, and with what the offsets have been found to be."""
    values = np.asarray(held.values + shift)
    for output in set(held.terms.output.tolist()):
        values[held.terms.offset_of(output)] += held.offsets[output]
    return values
