"""The reference model: the derivatives before a fault, and their covariance.

The derivatives are at first those of the aircraft file, with its tolerances. Valid estimates of the identifier replace
them when they are old enough not to include a fault that is found now. So do its estimates of how late each servo is,
valid or not, as its standard error says how well that is known. They are refined by least squares on the
whitened blocks since then, constrained to these values (modified sequential least squares: Ward, Monaco & Bodson, J.
Guidance 21(6), 1998), corrected for the noise of the vanes (bias-compensated least squares: Soderstrom, Automatica 43,
2007, sec. 5).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.faults.model.lagged_controls import shares_of
from sysid_node.faults.model.residual_whitening import WhiteningFilter
from sysid_node.faults.model.terms import Terms
from sysid_node.online.types import DerivativeEstimate

Array = NDArray[np.float64]

RIPE = 10.0  # s, age at which estimates are adopted
REAL = 0.5  # least share of motion, not noise, in the information along a direction that is learned
UNCONFIRMED = 3.0  # tolerances of the file that a derivative may be off before the flight has shown it, 1 sigma
KEPT = 0.9995  # factor of the old information at each block: a memory of 200 s


class IdentifierEstimate(NamedTuple):
    """A derivative, or how late a servo is (s), as identified."""

    value: float
    standard_error: float
    valid: bool


class IdentifierEstimates(NamedTuple):
    """What the identifier says at one time, in the form that the monitor takes."""

    derivatives: Mapping[str, IdentifierEstimate]
    servos: Mapping[str, IdentifierEstimate]  # how late each control's is, s
    changed: bool  # whether it announces a change of the aircraft


def identifier_estimates(
    derivatives: Iterable[DerivativeEstimate], servos: Iterable[DerivativeEstimate]
) -> IdentifierEstimates:
    """The identifier's estimates: those of a replay, or a message's."""
    derivatives = list(derivatives)
    known, late = (
        {d.name: IdentifierEstimate(d.value, d.standard_error, d.valid) for d in those}
        for those in (derivatives, servos)
    )
    return IdentifierEstimates(known, late, any(d.status == "changed" for d in derivatives))


@dataclass
class ReferenceModel:
    """Values (D,), standard errors (D,), the information of the flight since, and offsets."""

    terms: Terms
    values: Array
    errors: Array
    regressors: Array  # (D,) recent mean of each term's regressor
    J: Array  # (D, D) information of the flight without a fault
    v: Array  # (D,) its score about the values
    blocks: Array  # (D, D) number of blocks in it
    noisy: dict[str, Array] = field(default_factory=dict)  # (D, D) of these, how many have the noise of each vane
    offsets: Array = field(default_factory=lambda: np.zeros(6))  # of the coefficients, part of the model
    pending: deque[tuple[float, IdentifierEstimates]] = field(default_factory=deque)


class ModelPrior(NamedTuple):
    """The distribution of the derivatives without a fault: mean minus reference values (D,), and precision (D, D)."""

    shift: Array
    precision: Array


def init(terms: Terms) -> ReferenceModel:
    """The reference model of the aircraft file.

    A fault is a change in flight. What the flight has not shown yet may differ from the file because the file is wrong.
    """
    count = len(terms.names)
    nothing = np.zeros(count)
    none = np.zeros((count, count))
    return ReferenceModel(
        terms, terms.values.copy(), UNCONFIRMED * terms.tolerance, nothing, none, nothing.copy(), none.copy()
    )


def receive_estimates(reference: ReferenceModel, time: float, known: IdentifierEstimates) -> None:
    """Take estimates at a time (s). One set each 10 s is kept until it is old enough."""
    if reference.pending and time < reference.pending[-1][0]:
        reference.pending.clear()  # the clock has stepped back
    if not reference.pending or time - reference.pending[-1][0] >= RIPE:
        reference.pending.append((time, known))


def adopt_estimates(reference: ReferenceModel, now: float) -> bool:
    """Adopt the estimates that are old enough at a time (s); returns whether there were any."""
    taken = False
    while reference.pending and now - reference.pending[0][0] >= RIPE:
        _, known = reference.pending.popleft()
        for name, one in known.derivatives.items():
            if name in reference.terms.names and one.valid and math.isfinite(one.value + one.standard_error):
                taken = True
                d = reference.terms.names.index(name)
                _keep_mean(reference, d, one.value - reference.values[d])
                _adopt(reference, d, one.value, one.standard_error)
        for name, one in known.servos.items():
            if name in reference.terms.servos and math.isfinite(one.value + one.standard_error):
                taken = True
                servo, _ = reference.terms.servos[name]
                for d, share, error in zip(servo, *shares_of(one.value, one.standard_error), strict=True):
                    _adopt(reference, int(d), float(share), float(error))
    return taken


def _keep_mean(reference: ReferenceModel, d: int, change: float) -> None:
    """Change the offset of a term's coefficient, so that a ``change`` of the term leaves its recent mean as it is."""
    output = int(reference.terms.output[d])
    less = change * reference.regressors[d]
    reference.offsets[output] -= less
    reference.v += less * reference.J[:, reference.terms.offset_of(output)]


def _adopt(reference: ReferenceModel, d: int, value: float, error: float) -> None:
    """Put another value with its standard error in the place of a term's."""
    reference.v -= (value - reference.values[d]) * reference.J[:, d]
    reference.values[d], reference.errors[d] = value, error


def commanded(reference: ReferenceModel) -> set[str]:
    """The controls of which the commands are known, and not the positions: the identifier estimates their servos."""
    return {name for name, (servo, _) in reference.terms.servos.items() if reference.errors[servo].any()}


def learn(reference: ReferenceModel, J: Array, v: Array, chosen: NDArray[np.bool_], noisy: Mapping[str, float]) -> None:
    """Add the information of a block without a fault about the ``chosen`` terms (D,).

    ``noisy``: the share of each vane's noise that it has (``hypotheses.vane_noise``).
    """
    both = np.outer(chosen, chosen)
    reference.blocks = KEPT * reference.blocks + both
    for vane, share in noisy.items():
        reference.noisy[vane] = KEPT * reference.noisy.get(vane, np.zeros_like(J)) + share * both
    reference.J = KEPT * reference.J + both * J
    reference.v = KEPT * reference.v + chosen * v


def noise_of(terms: Terms, whitening: WhiteningFilter, regressor: str, variance: float) -> Array:
    """(D, D) the information that noise of a ``variance`` on a regressor adds to a block."""
    noisy = np.flatnonzero(terms.of(regressor))
    design = np.zeros((6, len(terms.names)))
    design[terms.output[noisy], noisy] = np.sqrt(variance)
    parts = (whitening.unmix @ (taps[:, None] * design) for taps in (np.ones(6), *whitening.filter))
    return np.asarray(sum(part.T @ part for part in parts))


def model_prior(reference: ReferenceModel, noise: Array, slack: float) -> ModelPrior:
    """The prior of the derivatives without a fault; changes by a share ``slack`` of each are allowed for.

    ``noise`` (D, D) is the part of the information that is due to noise on the regressors.
    """
    terms, values = reference.terms, reference.values
    root = np.linalg.cholesky(_covariance(reference))
    size, axes = np.linalg.eigh(root.T @ (reference.J - noise) @ root)
    axes = root @ axes
    # nothing is learned where noise is as large a part of the information as motion: the noise is not known that well
    learned = size > REAL * np.einsum("di,de,ei->i", axes, reference.J, axes)
    size = np.where(learned, size, 0.0)
    covariance = (axes / (1.0 + size)) @ axes.T
    shift = axes @ np.where(learned, axes.T @ (reference.v + noise @ values) / (1.0 + size), 0.0)
    values = values + shift
    loose = (slack * values) ** 2
    for output in terms.coefficients:
        mine = terms.output == output
        d = terms.offset_of(output)
        # offsets are learned separately, for the reference values: a shift of the others must not change the mean
        mine[d] = False
        shift[d] = -float(shift[mine] @ reference.regressors[mine])
        # and their uncertainty includes that due to the slack of the other terms
        loose[d] = float(((slack * values * terms.signal)[mine] ** 2).sum()) + (slack * values[d]) ** 2 + 1e-12
    return ModelPrior(shift, np.asarray(np.linalg.inv(covariance + np.diag(loose)), dtype=np.float64))


def _covariance(reference: ReferenceModel) -> Array:
    """(D, D) covariance of the reference values: an independent part and an equal part common to each coefficient.

    A wrong area, inertia or airspeed calibration scales all derivatives of a coefficient alike.
    """
    terms, errors = reference.terms, np.maximum(reference.errors, 1e-9)
    found = np.diag(errors**2)
    for output in terms.coefficients:
        mine = (terms.output == output) & (terms.signal < 1.0)
        share = float(np.median(errors[mine] / np.maximum(np.abs(reference.values[mine]), 1e-9))) if mine.any() else 0.0
        common = np.where(terms.output == output, min(share, 1.0) * reference.values, 0.0)
        found += np.outer(common, common)
    return found


def whole(reference: ReferenceModel, shift: Array) -> Array:
    """(D,) the values with a ``shift`` and with the learned offsets."""
    values = np.asarray(reference.values + shift)
    for output in reference.terms.coefficients:
        values[reference.terms.offset_of(output)] += reference.offsets[output]
    return values
