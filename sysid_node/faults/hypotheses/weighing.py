"""All hypotheses over one stretch of flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.hypotheses.bayes_factors import (
    Shifts,
    Weighed,
    marginal,
    most,
    score_squares,
    weigh_each,
    weigh_loosely,
)
from sysid_node.faults.hypotheses.vane_check import stuck_factor
from sysid_node.faults.model import gust_correlation, residual_whitening
from sysid_node.faults.model.reference_model import ModelPrior
from sysid_node.faults.model.residual_whitening import ORDER
from sysid_node.faults.state import MonitorState, WhitenedBlock
from sysid_node.online.frequency.regression_signals import OFFSET

Array = NDArray[np.float64]

#: Vanes: column of a block's air data, and the coefficient that tells their angle.
VANES = {"alpha": (1, COEFFICIENTS.index("CL")), "beta": (2, COEFFICIENTS.index("CY"))}


LOOSE = 0.1  # share by which a fault may differ from its hypothesis
ENOUGH = 3  # blocks of sound flight that say something of it
LONG = 20  # blocks
MARGIN = 1.0  # of a logarithm, for the statistics' rounding
LAST_RESORT = 0.1  # share by which damage of a whole axis, which can explain all, must explain more than what is simple


class FlightInterval(NamedTuple):
    """The last blocks, what is believed, what they sum up to against it, and that without what its errors allow."""

    pieces: Sequence[WhitenedBlock]
    belief: ModelPrior
    whole: tuple[Array, Array]
    J: Array
    v: Array


def last_interval(state: MonitorState, count: int, belief: ModelPrior | None = None) -> FlightInterval:
    """The last ``count`` blocks, against a belief; None: what is believed by now."""
    belief = belief or state.belief
    assert belief is not None
    pieces = _last(state, count)
    J, v = (np.sum([getattr(piece, name) for piece in pieces], axis=0) for name in "Jv")
    return _against(state, pieces, (J, v), belief)


def changed_since(state: MonitorState, count: int, belief: ModelPrior) -> FlightInterval:
    """What set in ``count`` blocks ago.

    What the first blocks' whitening takes from the blocks before them is of the sound aircraft: the moment of a change
    shows more than what follows, and only so does it speak for what changed (the signature of Willsky & Jones 1976).
    """
    pieces = _last(state, count)
    first = [_begun(piece, late, belief) for late, piece in enumerate(pieces[:ORDER])]
    pieces = [*first, *pieces[ORDER:]]
    J, v = (np.sum([getattr(piece, name) for piece in pieces], axis=0) for name in "Jv")
    return _against(state, pieces, (J, v), belief)


def onsets(state: MonitorState, counts: Sequence[int], sound: int) -> list[FlightInterval]:
    """As ``since``, of each count, against what is believed together with what the blocks before it say of it.

    They begin ``sound`` blocks ago. What was off before something failed was off by then, too: an offset that the held
    model's errors would allow for does not come from one block to the next.
    """
    assert state.belief is not None
    pieces, prior = _last(state, sound), state.belief
    read = _readings(pieces)
    J, v = (np.cumsum([getattr(piece, name) for piece in pieces], axis=0) for name in "Jv")
    found = []
    for count in counts:
        n = sound - count
        before, belief = (np.zeros_like(J[0]), np.zeros_like(v[0])), prior
        if n >= ENOUGH:
            before = (J[n - 1], v[n - 1])
            precision = prior.precision + before[0]
            score = before[1] - before[0] @ prior.shift + _flattened(state, read[:n])
            belief = ModelPrior(prior.shift + np.linalg.solve(precision, score), precision)
        first = [_begun(piece, late, belief) for late, piece in enumerate(pieces[n : n + ORDER])]
        rest = [total[-1] - total[n + len(first) - 1] for total in (J, v)]
        sums = [sum((getattr(piece, name) for piece in first), start) for name, start in zip("Jv", rest, strict=True)]
        found.append(_against(state, [*first, *pieces[n + ORDER :]], (sums[0], sums[1]), belief))
    return found


def allowing_for_gusts(state: MonitorState, over: FlightInterval) -> FlightInterval:
    """A stretch against a belief that allows for what gusts may have taught (``gusts``)."""
    J, v = over.whole
    allowed = np.linalg.inv(over.belief.precision) + gust_correlation.gust_covariance(state.held, J / len(over.pieces))
    belief = over.belief._replace(precision=np.asarray(np.linalg.inv(allowed)))
    return FlightInterval(over.pieces, belief, over.whole, *marginal(J, v, belief.precision))


def _last(state: MonitorState, count: int) -> list[WhitenedBlock]:
    return list(islice(state.pieces, len(state.pieces) - count, None))


def _against(
    state: MonitorState, pieces: Sequence[WhitenedBlock], sums: tuple[Array, Array], belief: ModelPrior
) -> FlightInterval:
    """Pieces whose information (D, D) and score (D,) about the held values are ``sums``."""
    J, v = sums
    v = v - J @ belief.shift + _flattened(state, _readings(pieces))
    return FlightInterval(pieces, belief, (J, v), *marginal(J, v, belief.precision))


def _readings(pieces: Sequence[WhitenedBlock]) -> Array:
    """(N, 3) of the air data."""
    return np.array([piece.block.air for piece in pieces])


def _flattened(state: MonitorState, read: Array) -> Array:
    """(D,) what noise of the vanes takes off the score of blocks that ``read`` (N, 3).

    Noise on a regressor flattens the slope that least squares find, and over a long stretch in which the angle hardly
    moves that would look like a changed derivative (bias-compensated least squares: Soderstrom, Automatica 43, 2007,
    sec. 5). A vane that reads less than its noise has none of that size: it has jammed, or is a good one. Over a short
    stretch it makes at most half a logarithm a block, and what noise there was cannot be told from what is read.
    """
    total = np.zeros(len(state.terms.names))
    if len(read) < LONG:
        return total
    for vane, (variance, score) in state.flattened.items():
        there = float(read[:, VANES[vane][0]].var(ddof=1))
        total += min(1.0, there / variance) * len(read) * score
    return total


def _begun(piece: WhitenedBlock, late: int, belief: ModelPrior) -> WhitenedBlock:
    """A piece as of what set in ``late`` blocks before it."""
    A = piece.begun[late]
    b = piece.whitened + (A - piece.design) @ belief.shift
    return piece._replace(design=A, whitened=b, J=A.T @ A, v=A.T @ b)


def explained(state: MonitorState, over: FlightInterval, usual: Array) -> list[Weighed]:
    """Each hypothesis with what it leaves out (``evidence.weigh_loosely``), by the variance that the best leaves."""
    first = weights(state, over, usual)
    best = min(excess(state, over, place, weighed) for place, weighed in enumerate(first))
    scale = max(float(usual.max()), best, 1.0)
    found = []
    for hypothesis, weighed in zip(state.hypotheses, first, strict=True):
        moved = hypothesis.shift.fixed + hypothesis.shift.free @ weighed.size
        one = weigh_loosely(*over.whole, hypothesis.shift, over.belief.precision, LOOSE * moved, scale)
        if hypothesis.whole:
            one = replace(one, factor=one.factor - LAST_RESORT * abs(one.factor))
        found.append(one)
    return found


def statistics(state: MonitorState, over: FlightInterval) -> Array:
    """(H,) of each hypothesis; see ``evidence.score_squares``."""
    return score_squares(over.J, over.v, _shifts(state))


def weights(state: MonitorState, over: FlightInterval, usual: Array) -> list[Weighed]:
    """Each hypothesis; ``usual`` (H,) is the size of its statistic where nothing has failed."""
    return weigh_each(over.J, over.v, _shifts(state), np.maximum(usual, 1.0))


def promising(state: MonitorState, over: FlightInterval, usual: Array, squares: Array, least: float) -> list[Weighed]:
    """As ``weights``, where only factors beyond ``least`` matter; ``squares`` (H,) are the stretch's statistics."""
    usual = np.maximum(usual, 1.0)
    worth = most(_shifts(state), squares, usual) > least - MARGIN
    return weigh_each(over.J, over.v, _shifts(state), usual, worth)


def _shifts(state: MonitorState) -> Shifts:
    assert state.shifts is not None
    return state.shifts


def excess(state: MonitorState, over: FlightInterval, place: int, weighed: Weighed) -> float:
    """The residuals' variance that a hypothesis leaves, over the usual one: air may have become rougher, too.

    The largest of the six coefficients'.
    """
    shift = state.hypotheses[place].shift
    moved = shift.fixed + shift.free @ weighed.size + over.belief.shift
    left = np.array([piece.whitened - piece.design @ moved for piece in over.pieces])
    return float((left**2).mean(axis=0).max())


def vane_noise(state: MonitorState, samples: float) -> dict[str, float]:
    """Variance (rad^2) of each vane's noise in a block of so many ``samples``: the file's, or what residuals allow."""
    found = {}
    for vane, (_, output) in VANES.items():
        terms = np.flatnonzero((state.terms.output == output) & state.terms.of(vane))
        if terms.size:
            taps = state.colour.filter[:, output]
            slope = float(state.held.values[terms[0]])
            most = float(residual_whitening.scale(state.colour)[output] / slope) ** 2 / (1.0 + float(taps @ taps))
            found[vane] = min(state.aircraft.noise[vane] ** 2 / samples, most)
    return found


def stuck_vanes(state: MonitorState, pieces: Sequence[WhitenedBlock], counts: Sequence[int] = ()) -> Array:
    """(N, 2) logarithms of the Bayes factors of jammed vanes over the last ``counts`` (N) pieces, or over all."""
    counts = counts or [len(pieces)]
    found = np.zeros((len(counts), len(VANES)))
    for place, (vane, (column, output)) in enumerate(VANES.items()):
        terms = np.flatnonzero((state.terms.output == output) & state.terms.of(vane))
        if not terms.size:
            continue
        slope = float(state.held.values[terms[0]])  # what flight has shown on top is too little to matter here
        read = np.array([piece.block.air[column] for piece in pieces])
        off = [(p.residual[output] / p.block.regressors[OFFSET] - state.held.offsets[output]) for p in pieces]
        asked = read + np.array(off) / slope
        samples = float(np.mean([piece.block.samples for piece in pieces]))
        noise = vane_noise(state, samples)[vane]
        difference = float(residual_whitening.scale(state.colour)[output] / slope) ** 2
        taps = state.colour.filter[:, output]
        found[:, place] = [stuck_factor(read[-n:], asked[-n:], taps, noise, difference) for n in counts]
    return found
