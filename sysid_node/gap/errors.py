"""Standard errors of what was fitted, that do not take the remainder's word for being noise.

White in its own spectrum, the remainder would make the inverse of the information the covariance. What the model lacks
repeats itself from window to window instead; so the estimating equations are summed by groups of windows, and their
scatter from group to group is taken where it is more (White (1982), Econometrica 50(1); by clusters: Liang & Zeger
(1986), Biometrika 73(1)).
"""

from __future__ import annotations

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.evidence import groups_of
from sysid_node.gap.fit import Fit
from sysid_node.gap.nuisance import gusty
from sysid_node.gap.structure import equations
from sysid_node.gap.view import CHANNELS


def standard_errors(fit: Fit) -> Array:
    """Of all unknowns (unknowns,), of a fit as ``structure.unbiased`` leaves it."""
    scores = _instrumented(fit) if any(gusty(view) for view in fit.views) else _whole(fit)
    covariance = fit.covariance
    groups = np.array([part[group].sum(axis=0) for view, part in zip(fit.views, scores, strict=True)
                       for group in groups_of(view)])  # fmt: skip
    steps = (groups - groups.mean(axis=0)) @ covariance
    scatter = (steps**2).sum(axis=0) * len(groups) / max(len(groups) - 1, 1)
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance), scatter)))


def _whole(fit: Fit) -> list[Array]:
    """Estimating equations (W, unknowns) of least squares by window, by flight."""
    return [np.einsum("wru,wr->wu", J, r) for J, r in zip(fit.slopes, fit.rows, strict=True)]


def _instrumented(fit: Fit) -> list[Array]:
    """The same with the slopes as the instruments have them, and of the means, which these leave out."""
    seen, found = equations(fit, fit.power), []
    for basis, r, J, rows, slopes in zip(seen.basis, seen.rows, seen.slopes, fit.rows, fit.slopes, strict=True):
        mean = rows.reshape(rows.shape[0], -1, len(CHANNELS))[:, 0]
        slope = slopes.reshape(slopes.shape[0], -1, len(CHANNELS), slopes.shape[2])[:, 0]
        scores = np.einsum("wau,wa->wu", slope, mean)
        for axis, directions in basis.items():
            own = J[:, :, axis].reshape(-1, J.shape[3])
            projected = (directions @ (directions.T @ own)).reshape(J[:, :, axis].shape)
            scores += np.einsum("wru,wr->wu", projected, r[:, :, axis])
        found.append(scores)
    return found
