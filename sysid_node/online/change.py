"""Abrupt changes of the aircraft, and flight that the model no longer explains.

The transforms of the last few seconds are kept in pieces. Each time a piece is complete, the equations over the last
one to four seconds are tested against the estimates from before them: the score A'r of the residual r is
zero-mean with covariance s^2 A'KA + G C G while nothing has changed (C: covariance of the earlier estimates, G = A'A),
so Q = (A'r)' Cov^-1 (A'r) is chi-square (Basseville & Nikiforov, "Detection of Abrupt Changes", 1993, sec. 7.2,
the generalised likelihood ratio over the time of change). A change is announced when Q cannot be chance and the
changed derivatives explain most of what the old ones leave. Residuals that nothing explains are another matter:
the model itself does not hold there (near the stall, say).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import gdtrix

from sysid_node.online.information import Information, measure
from sysid_node.online.regression import Plan, Solution, Uncertainty

Array = NDArray[np.float64]

PIECE = 0.5  # s
SPANS = (2, 3, 4, 6, 8)  # pieces looked back over
FALSE_ALARM = 1e-12  # a test, of some 7200 pieces an hour, times six coefficients and five spans
EXPLAINED = 0.6  # share of the misfit that changed derivatives must explain
MISFIT = 0.05  # share of the motion's energy that the misfit must reach to matter
LOST = 0.25  # share of the motion's energy left unexplained beyond which the model does not hold
KNOWN = 12.0  # degrees of freedom that the earlier estimates must rest on
NOISE_RATIO = 9.0  # and by how much the residual must stand above its usual density


@dataclass(frozen=True)
class Reference:
    """The estimates as they stood at one time (s)."""

    time: float
    solution: Solution
    uncertainty: Uncertainty


@dataclass
class Watch:
    """The last pieces of the transform and the estimates that belong to their starts."""

    pieces: deque[tuple[float, Array]] = field(default_factory=lambda: deque(maxlen=SPANS[-1]))  # start, (2F+1, W)
    references: deque[Reference] = field(default_factory=lambda: deque(maxlen=SPANS[-1] + 1))


@dataclass(frozen=True)
class Finding:
    """What the last seconds say of each coefficient (C,), and since when the aircraft has changed, if it has."""

    changed_since: float | None
    lost: NDArray[np.bool_]


def _reference(watch: Watch, start: float) -> Reference | None:
    """The latest estimates from before ``start`` (s)."""
    earlier = [r for r in watch.references if r.time <= start + 1e-6]
    return earlier[-1] if earlier else None


def examine(plan: Plan, watch: Watch, omega: Array, now: float) -> Finding:
    """Test every span of the last pieces; see the module's text."""
    lost = np.zeros(len(plan.coefficients), dtype=bool)
    best, since = 0.0, None
    for span in SPANS:
        if len(watch.pieces) < span:
            break
        start = watch.pieces[-span][0]
        reference = _reference(watch, start)
        if reference is None:
            break
        total = np.sum([piece for _, piece in list(watch.pieces)[-span:]], axis=0)
        window = measure(total, omega, start, now, np.inf)
        for c in range(len(plan.coefficients)):
            score, unexplained = _test(plan, reference, window, c)
            if score > max(best, 1.0):
                # the change fell somewhere in the oldest piece: what came after it is all new
                best, since = score, watch.pieces[1 - span][0]
            if span == SPANS[2] and unexplained:
                lost[c] = True
    return Finding(since, lost)


def _test(plan: Plan, reference: Reference, window: Information, c: int) -> tuple[float, bool]:
    """(Q over its threshold, or 0 where a change explains too little; whether the model is lost) for one coefficient."""
    mine, y = plan.unknowns(c), plan.outputs[c]
    J = plan.columns[mine]
    density = float(reference.uncertainty.density[c])
    if reference.uncertainty.freedom[c] < KNOWN:
        return 0.0, False
    gram, scores = window.grams.sum(axis=0), window.scores.sum(axis=0)
    v = np.zeros(gram.shape[0])
    v[y], v[J] = 1.0, -reference.solution.theta[mine, c]
    misfit, motion = float(v @ gram @ v), float(gram[y, y])
    G, score = gram[np.ix_(J, J)], (gram @ v)[J]
    ridge = G + np.diag(G.diagonal() * 1e-9 + 1e-300)
    step = np.linalg.solve(ridge, score)
    explained = float(score @ step)
    free = max(float(window.traces.sum()) - float(np.trace(np.linalg.solve(ridge, scores[np.ix_(J, J)]))), 0.1 * float(window.traces.sum()))
    noise = max(density, (misfit - explained) / free)
    unexplained = misfit - explained > LOST * motion and (misfit - explained) / free > NOISE_RATIO * density
    if explained < EXPLAINED * misfit or misfit < MISFIT * motion:
        return 0.0, unexplained
    C = reference.uncertainty.covariance[c][np.ix_(mine, mine)]
    spread = noise * scores[np.ix_(J, J)] + G @ C @ G
    Q = float(score @ np.linalg.solve(spread + np.diag(spread.diagonal() * 1e-9), score))
    return Q / (2.0 * float(gdtrix(1.0, 0.5 * J.size, 1.0 - FALSE_ALARM))), unexplained
