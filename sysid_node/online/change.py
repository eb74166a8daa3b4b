"""Abrupt changes of the aircraft, and flight that the model no longer explains.

The transforms of the last few seconds are kept in pieces. Each time a piece is complete, the equations over the last
one to four seconds are tested against the estimates from before them: the score A'r of the residual r is zero-mean with
covariance s^2 A'KA + G C G while nothing has changed (C: covariance of the earlier estimates, G = A'A; with
instruments Z'r and Z'KZ, G = Z'A, so that gusts are no change), so Q = (A'r)'
Cov^-1 (A'r) is chi-square (Basseville & Nikiforov, "Detection of Abrupt Changes", 1993, sec. 7.2, the generalised
likelihood ratio over the time of change). Over spans much shorter than the period of the line spacing, A'KA is A'A over
twice that spacing, whatever the span. A change is announced when Q cannot be chance and the changed derivatives explain
most of what the old ones leave. Residuals that nothing explains are another matter: the model itself does not hold
there (near the stall, say).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import gdtrix

from sysid_node.online.auxiliary import Auxiliary
from sysid_node.online.information import products
from sysid_node.online.regression import STRONG, TINY, Plan, Solution, Uncertainty, misfits

Array = NDArray[np.float64]

PIECE = 0.5  # s
SPANS = (2, 4, 8)  # pieces looked back over
FALSE_ALARM = 1e-12  # a test: 7200 pieces an hour, times six coefficients and three spans
MARGIN = 3.0  # and Q must exceed what chance allows by this factor: no model is exact
EXPLAINED = 0.6  # share of the misfit that changed derivatives must explain
MISFIT = 0.05  # share of the motion's energy that the misfit must reach to matter
KNOWN = 12.0  # degrees of freedom that the earlier estimates must rest on
NOISY = 3.0  # times the noise's usual energy that the misfit must reach to be looked into
LOST = 0.25  # share of the motion's energy left unexplained beyond which the model does not hold
NOISE_RATIO = 9.0  # and by how much the residual must stand above its usual density
USUAL = 4  # pieces in the span by which the usual size of Q is judged
LEARNING = 0.05  # weight of each new Q in that judgement
OUTLIER = 20.0  # a Q per derivative beyond this is no usual one


@dataclass(frozen=True)
class Reference:
    """The estimates as they stood at one time (s)."""

    time: float
    solution: Solution
    uncertainty: Uncertainty
    strength: Array  # (P,) of the instruments that it rests on


@dataclass
class Watch:
    """The last pieces of the transform, the estimates that belong to their starts, and the usual Q per derivative."""

    pieces: deque[tuple[float, Array]] = field(default_factory=lambda: deque(maxlen=SPANS[-1]))  # start, (2F+1, W)
    references: deque[Reference] = field(default_factory=lambda: deque(maxlen=SPANS[-1] + 1))
    usual: dict[int, float] = field(default_factory=dict)  # by coefficient: 1 where the model is exact


@dataclass(frozen=True)
class Finding:
    """What the last seconds say of each coefficient (C,), and since when the aircraft has changed, if it has."""

    changed_since: float | None
    lost: NDArray[np.bool_]


@dataclass(frozen=True)
class _Misfit:
    """One coefficient's equation over one span, by the earlier estimates."""

    per_derivative: float  # Q over its number of derivatives
    over_chance: float  # Q over what chance allows
    explained: bool  # whether changed derivatives explain it
    unexplained: bool  # whether nothing does


def examine(plan: Plan, model: Auxiliary | None, watch: Watch, density_per_gram: float, now: float) -> Finding:
    """Test every span of the last pieces; see the module's text.

    ``density_per_gram`` (s): A'KA over A'A where the span is much shorter than the period of the line spacing.
    """
    lost = np.zeros(len(plan.coefficients), dtype=bool)
    best, since = MARGIN, None
    for span in (span for span in SPANS if span <= len(watch.pieces)):
        start = watch.pieces[-span][0]
        reference = next((r for r in reversed(watch.references) if r.time <= start + 1e-6), None)
        if reference is None:
            break
        part = np.sum([piece for _, piece in list(watch.pieces)[-span:]], axis=0)
        gram = products(part, model)
        energy = 0.5 * (len(part) - 1) * (now - start)
        for c in _suspects(plan, reference, gram, energy):
            misfit = _misfit(plan, reference, gram, c, density_per_gram, energy)
            usual = max(watch.usual.get(c, 1.0), 1.0)
            if misfit.explained and misfit.over_chance > best * usual:
                # the change fell somewhere in the oldest piece: what came after it is all new
                best, since = misfit.over_chance / usual, watch.pieces[1 - span][0]
            if span == USUAL:
                lost[c] = misfit.unexplained
                watch.usual[c] = usual + LEARNING * (min(misfit.per_derivative, OUTLIER) - usual)
    return Finding(since, lost)


def _suspects(plan: Plan, reference: Reference, gram: Array, energy: float) -> list[int]:
    """Coefficients whose earlier estimates are trusted and miss more than noise, a share of the motion that matters."""
    v = misfits(plan, reference.solution.theta)
    misfit = ((gram @ v) * v).sum(axis=0)
    motion = gram.take(plan.square)
    missed = (misfit > MISFIT * motion) & (misfit > NOISY * energy * reference.uncertainty.density) & (motion > TINY)
    firm = (np.where(plan.mine > 0.0, reference.strength[:, None], np.inf) >= STRONG).all(axis=0)
    return np.flatnonzero(missed & firm & (reference.uncertainty.freedom >= KNOWN)).tolist()


def _misfit(plan: Plan, reference: Reference, gram: Array, c: int, density_per_gram: float, energy: float) -> _Misfit:
    """How badly the earlier estimates of a coefficient fit the span, and what would mend it."""
    mine, y = plan.unknowns(c), plan.outputs[c]
    J = plan.columns[mine]
    density = float(reference.uncertainty.density[c])
    v = np.zeros(plan.width)
    v[y], v[J] = 1.0, -reference.solution.theta[mine, c]
    misfit, motion = float(v @ gram @ v), float(gram[y, y])
    Z = plan.instruments[mine]
    G, left_over = gram[np.ix_(Z, J)], gram @ v
    score = left_over[Z]
    mended = np.linalg.lstsq(G, score, rcond=1e-9)[0]
    explained = float(2.0 * mended @ left_over[J] - mended @ gram[np.ix_(J, J)] @ mended)
    # nuisances and unknowns take up as much of the noise's energy as of independent lines
    left = (misfit - explained) / max(energy - (J.size + 3) * density_per_gram, 0.1 * energy)
    C = reference.uncertainty.covariance[c][np.ix_(mine, mine)]
    spread = max(density, left) * density_per_gram * gram[np.ix_(Z, Z)] + G @ C @ G.T
    Q = float(score @ np.linalg.solve(spread + np.diag(spread.diagonal() * 1e-9 + 1e-300), score))
    return _Misfit(
        per_derivative=Q / J.size,
        over_chance=Q / (2.0 * float(gdtrix(1.0, 0.5 * J.size, 1.0 - FALSE_ALARM))),
        explained=explained > EXPLAINED * misfit,
        unexplained=misfit - explained > LOST * motion and left > NOISE_RATIO * density,
    )
