"""What gusts may have taught.

Gusts are correlated with the motion that they make: air that turns comes with air that blows in at an angle, and
autopilots answer to both. Least squares take that for the aircraft's own, however long they learn (Ljung, "System
Identification", 2nd ed. (1999), sect. 13.4): a correlation rho of the residuals with the regressors shifts what is
learned by rho of the standard error that a single block leaves (Conley, Hansen & Rossi, "Plausibly exogenous", Review
of Economics and Statistics 94, 2012). A stretch that is moved in the same way is shifted by as much, and agrees. One
that is moved on purpose speaks for itself: along a direction in which its blocks say lambda times as much as those that
were learned from, 1 / lambda of the shift is left in it, and that it contradicts the rest means nothing. What was
learned from holds bursts of deliberate motion, too, so that a few times its mean counts as moved in the same way.

Beside the correlation that is always there, a few gusts in a row make one by chance, which the dozen derivatives of a
whole axis take up, whatever its direction (``surprise``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.faults.model.reference_model import ReferenceModel
from sysid_node.faults.model.terms import Terms

Array = NDArray[np.float64]

BY_CHANCE = 0.1  # of the residuals of a single stretch with all of an axis's regressors, beside what they always have
CORRELATION = 0.5  # of residuals with regressors; in moderate turbulence 0.1 to 1 were seen, by coefficient and flight
ALIKE = 3.0  # times what a block that was learned from says, up to which a stretch is moved in the same way
LEAST = 20.0  # blocks, of which something is learned
_RIDGE = 1e-6


def gust_covariance(held: ReferenceModel, information: Array) -> Array:
    """(D, D) by how much more the held terms may be off, seen from a stretch.

    ``information`` (D, D) is what a block of the stretch says of them, in the mean.
    """
    terms = held.terms
    slopes = np.flatnonzero(~terms.of("0") & (np.diag(held.blocks) >= LEAST))
    if not slopes.size:
        return np.zeros_like(information)
    count = np.sqrt(np.maximum(np.diag(held.blocks), 1.0))
    learned = _of_slopes(held.J / np.outer(count, count), terms, slopes)
    scale = 1.0 / np.sqrt(np.diag(learned))
    root = np.linalg.inv(np.linalg.cholesky(learned * np.outer(scale, scale) + _RIDGE * np.eye(slopes.size)))
    root = root * scale
    times, axes = np.linalg.eigh(root @ _of_slopes(information, terms, slopes) @ root.T)
    unshared = np.maximum(1.0 - ALIKE / np.maximum(times, ALIKE), 0.0)
    shift = CORRELATION * (root.T @ axes) * unshared
    moved = np.zeros((len(information), slopes.size))
    moved[slopes] = shift
    for output in set(terms.output[slopes].tolist()):  # the offset makes up for it, see ``held.belief``
        mine = terms.output[slopes] == output
        moved[terms.offset_of(output)] = -held.regressors[slopes[mine]] @ shift[mine]
    return np.asarray(moved @ moved.T)


def usual_size_in_gusts(whole: NDArray[np.bool_], usual: Array, blocks: int) -> Array:
    """(H,) how large each shift's mean square score may be in a stretch of so many blocks where nothing has failed.

    ``usual`` (H,) is what it was of late. Damage of a ``whole`` axis (H,) takes up what a few gusts in a row do to any
    of its derivatives, as one direction hardly does: a correlation of rho adds rho^2 for every block.
    """
    found = np.maximum(usual, 1.0)
    found[whole] = np.maximum(found[whole], 1.0 + BY_CHANCE**2 * blocks)
    return np.asarray(found)


def _of_slopes(J: Array, terms: Terms, slopes: NDArray[np.intp]) -> Array:
    """Information about some terms in one (D, D) about all, where their coefficients' offsets are not known."""
    offsets = np.array([terms.offset_of(output) for output in sorted(set(terms.output[slopes].tolist()))])
    among, across = J[np.ix_(offsets, offsets)], J[np.ix_(offsets, slopes)]
    among = among + np.diag(_RIDGE * np.diag(among) + 1e-12)
    return np.asarray(J[np.ix_(slopes, slopes)] - across.T @ np.linalg.solve(among, across))
