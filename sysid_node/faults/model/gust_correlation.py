"""Bounds on the bias of the learned derivatives due to gusts.

Gusts are correlated with the motion that they cause: rotating air comes with changes of the flow angles, and autopilots
respond to both. Least squares are biased by this, however long they learn (Ljung, "System Identification", 2nd ed.
(1999), sect. 13.4). A correlation rho of residuals and regressors shifts the estimate by rho times the standard error
of a single block (Conley, Hansen & Rossi, "Plausibly exogenous", Review of Economics and Statistics 94, 2012). An
interval with the same kind of motion has the same shift, and does not contradict the reference. In an interval with
deliberate motion, along a direction in which its blocks hold lambda times the information of those that were learned
from, only 1 / lambda of the shift remains, and a contradiction of this size is no evidence of a fault. As the flight
that was learned from has deliberate motion, too, an interval with up to a few times its mean information counts as the
same kind.

A fault may also change the mean motion. Then the shift acts as one of the offset, whatever the information
(``offset_covariance``), and the size of a fault that changes offsets is no better known than that.

In addition, a few gusts in a row have a correlation by chance. The dozen derivatives of a whole axis fit it whatever
its direction (``usual_size_in_gusts``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.faults.model.reference_model import ReferenceModel
from sysid_node.faults.model.terms import Terms

Array = NDArray[np.float64]

BY_CHANCE = 0.1  # correlation of the residuals of one interval with all regressors of an axis, by chance
CORRELATION = 0.5  # of residuals and regressors; 0.1 to 1 in moderate turbulence, by coefficient and flight
ALIKE = 3.0  # ratio of information to the mean block's, up to which an interval has the same kind of motion
LEAST = 20.0  # blocks that a term must have been learned from
UNMOVED = 1e-9  # information learned of a term, in units of its prior's, that counts at least
_EXACT = 1e-9  # standard error of a term that is known exactly
_RIDGE = 1e-6


def gust_covariance(reference: ReferenceModel, information: Array) -> Array:
    """(D, D) the additional covariance of the reference derivatives, for the comparison with an interval.

    ``information`` (D, D) is the mean information of a block of the interval.
    """
    terms, slopes = reference.terms, _learned_slopes(reference)
    if not slopes.size:
        return np.zeros_like(information)
    learned = _learned_by_block(reference, slopes)
    scale = 1.0 / np.sqrt(np.diag(learned))
    root = np.linalg.inv(np.linalg.cholesky(learned * np.outer(scale, scale) + _RIDGE * np.eye(slopes.size)))
    root = root * scale
    times, axes = np.linalg.eigh(root @ _of_slopes(information, terms, slopes) @ root.T)
    unshared = np.maximum(1.0 - ALIKE / np.maximum(times, ALIKE), 0.0)
    shift = CORRELATION * (root.T @ axes) * unshared
    moved = np.zeros((len(information), slopes.size))
    moved[slopes] = shift
    for output in set(terms.output[slopes].tolist()):  # the offset compensates for it, see ``model_prior``
        mine = terms.output[slopes] == output
        moved[terms.offset_of(output)] = -reference.regressors[slopes[mine]] @ shift[mine]
    return np.asarray(moved @ moved.T)


def offset_covariance(reference: ReferenceModel, regressors: Array) -> Array:
    """(D, D) the covariance of the offsets due to the biased slopes, where the mean motion is another one.

    ``regressors`` (D,) are the terms' means in an interval. Offsets were learned at the usual mean motion. About
    another one, as an aircraft has whose surface is stuck, a shift of the slopes acts as a shift of the offset. All
    slopes of a coefficient together share the correlation with its residual.
    """
    terms, slopes = reference.terms, _learned_slopes(reference)
    if not slopes.size:
        return np.zeros((regressors.size, regressors.size))
    block = np.linalg.inv(_learned_by_block(reference, slopes))
    away = np.zeros((regressors.size, slopes.size))
    for output in set(terms.output[slopes].tolist()):
        mine = terms.output[slopes] == output
        change = (regressors - reference.regressors)[slopes[mine]]
        away[terms.offset_of(output), mine] = CORRELATION * change / np.sqrt(mine.sum())
    return np.asarray(away @ block @ away.T)


def _learned_slopes(reference: ReferenceModel) -> NDArray[np.intp]:
    """The slopes of coefficients that enough blocks were learned of."""
    enough = np.diag(reference.blocks) >= LEAST
    return np.flatnonzero((reference.terms.output >= 0) & ~reference.terms.of("0") & enough)


def _learned_by_block(reference: ReferenceModel, slopes: NDArray[np.intp]) -> Array:
    """Information about some slopes in the mean block that was learned from."""
    count = np.sqrt(np.maximum(np.diag(reference.blocks), 1.0))
    least = UNMOVED / np.maximum(reference.errors, _EXACT) ** 2  # of what has never moved
    lacking = np.maximum(least - np.diag(reference.J), 0.0)
    return _of_slopes((reference.J + np.diag(lacking)) / np.outer(count, count), reference.terms, slopes)


def usual_size_in_gusts(whole: NDArray[np.bool_], usual: Array, blocks: int) -> Array:
    """(H,) the expected mean square score of each shift in an interval of so many blocks without a fault.

    ``usual`` (H,) is its recent mean. Damage of a ``whole`` axis (H,) fits the chance correlation of a few gusts with
    any of its derivatives, which a single direction hardly does: a correlation rho adds rho^2 for each block.
    """
    found = np.maximum(usual, 1.0)
    found[whole] = np.maximum(found[whole], 1.0 + BY_CHANCE**2 * blocks)
    return np.asarray(found)


def _of_slopes(J: Array, terms: Terms, slopes: NDArray[np.intp]) -> Array:
    """Information about some terms, from that about all (D, D), where the offsets of their coefficients are unknown."""
    offsets = np.array([terms.offset_of(output) for output in sorted(set(terms.output[slopes].tolist()))])
    among, across = J[np.ix_(offsets, offsets)], J[np.ix_(offsets, slopes)]
    among = among + np.diag(_RIDGE * np.diag(among) + 1e-12)
    return np.asarray(J[np.ix_(slopes, slopes)] - across.T @ np.linalg.solve(among, across))
