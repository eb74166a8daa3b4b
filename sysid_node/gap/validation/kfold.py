"""Parts of flights, each by a simulator that was fitted to the others: the check where no flight was held out.

A part may hold the only manoeuvre of its kind. What the others then say little of stays near the aircraft file, and
within its limits: unknowns that would go beyond are put there and the others are solved for anew, for cut off one by
one they would no longer agree with what the others' windows show (an angle of attack's lift that another term had made
up for).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.fit import Fit, amplitudes, bounded, moved, room, weights
from sysid_node.gap.estimation.predictive_density import Evidence, beside, groups_of, written
from sysid_node.gap.instruments.liml import sound, telling
from sysid_node.gap.instruments.overidentification import priors


def parted(evidence: Evidence, fit: Fit, *, filed: bool = False) -> Evidence:
    """Evidence with the residuals and parameters of each part as the others have it, about a fit that is ``unbiased``.

    ``filed``: nuisances stay where they are. The scores stay: they compare explanations of the same flights.
    """
    residuals, points = [], []
    for i, (view, steps) in enumerate(zip(fit.views, _steps(fit, filed=filed), strict=True)):
        weight = weights(view.windows, fit.power[i])
        unseen = amplitudes(fit.rows[i], weight)
        for group, step in zip(groups_of(view), steps, strict=True):
            unseen[group] = amplitudes(fit.rows[i][group] - fit.slopes[i][group] @ step, weight)
        residuals.append(unseen)
        points.append(tuple(written(fit, moved(fit, step).points[i]) for step in steps))
    return replace(evidence, residuals=tuple(residuals), points=tuple(points))


def _steps(fit: Fit, *, filed: bool) -> Iterator[list[Array]]:
    """By flight: the steps (unknowns,) that the unknowns take without each group of windows and its neighbours."""
    known, _ = telling(fit)
    precision, far = priors(fit)
    matrices = [np.einsum("wru,wrv->wuv", K, J, optimize=True) for K, J in zip(known, fit.slopes, strict=True)]
    scores = [np.einsum("wru,wr->wu", K, r) for K, r in zip(known, fit.rows, strict=True)]
    matrix = np.diag(precision) + sum(m.sum(axis=0) for m in matrices)
    score = -precision * far + sum(s.sum(axis=0) for s in scores)
    least, greatest = room(fit)
    if filed:
        least[len(fit.indices) :] = greatest[len(fit.indices) :] = 0.0
    for view, own, right in zip(fit.views, matrices, scores, strict=True):
        asides = [beside(group, view.windows.count) for group in groups_of(view)]
        yield [
            bounded(sound(matrix - own[a].sum(axis=0), precision), score - right[a].sum(axis=0), least, greatest)
            for a in asides
        ]
