"""Bayes factors of all hypotheses on an interval of flight."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.faults.hypotheses.bayes_factors import (
    Shift,
    Weighed,
    marginal,
    most,
    score_squares,
    weigh_each,
    weigh_loosely,
)
from sysid_node.faults.hypotheses.catalogue import Hypothesis, linearised
from sysid_node.faults.hypotheses.vane_check import stuck_factor
from sysid_node.faults.hypotheses.vane_noise import VANES, VaneReadings, noise_variances, readings, slopes
from sysid_node.faults.model import gust_correlation, residual_whitening
from sysid_node.faults.model.reference_model import ModelPrior
from sysid_node.faults.model.residual_whitening import ORDER
from sysid_node.faults.state import MonitorState, WhitenedBlock
from sysid_node.online.frequency.regression_signals import OFFSET

Array = NDArray[np.float64]

LOOSE = 0.1  # relative difference of a fault from its hypothesis that is allowed for
ENOUGH = 3  # least number of blocks before the onset that refine the prior
LONG = 20  # blocks, from which on the noise of the vanes is corrected for
MARGIN = 1.0  # of a log Bayes factor, allowance for rounding
LINEARISED = 3  # times that a shift is linearised about its size
LAST_RESORT = 0.1  # share taken off the log Bayes factor of damage of a whole axis, which can fit any change


class FlightInterval(NamedTuple):
    """An interval of flight: blocks, prior, their sums J and v, and these with the prior's uncertainty taken out."""

    pieces: Sequence[WhitenedBlock]
    prior: ModelPrior
    whole: tuple[Array, Array]
    J: Array
    v: Array


def last_interval(state: MonitorState, count: int, prior: ModelPrior | None = None) -> FlightInterval:
    """The interval of the last ``count`` blocks, with a prior; None: the present one."""
    prior = prior or state.hypotheses.prior
    pieces = _last(state, count)
    J, v = (np.sum([getattr(piece, name) for piece in pieces], axis=0) for name in "Jv")
    return _against(state, pieces, (J, v), prior)


def changed_since(state: MonitorState, count: int, prior: ModelPrior) -> FlightInterval:
    """The interval of the last ``count`` blocks, for a change that began with the first of them.

    The whitening of the first blocks uses the blocks before them, which had no change. The first blocks therefore hold
    more information about the change than the following ones (the failure signature of Willsky & Jones 1976).
    """
    pieces = _last(state, count)
    first = [_begun(piece, late, prior) for late, piece in enumerate(pieces[:ORDER])]
    pieces = [*first, *pieces[ORDER:]]
    J, v = (np.sum([getattr(piece, name) for piece in pieces], axis=0) for name in "Jv")
    return _against(state, pieces, (J, v), prior)


def onsets(state: MonitorState, counts: Sequence[int], sound: int) -> list[FlightInterval]:
    """As ``changed_since``, for each count, with a prior that includes the blocks before it, from ``sound`` blocks ago.

    An error of the reference model is present before a fault, too. With those blocks in the prior, an error that the
    prior's uncertainty would allow for is not mistaken for a change from one block to the next.
    """
    pieces, base_prior = _last(state, sound), state.hypotheses.prior
    read = readings(state, pieces, base_prior.shift)
    J, v = (np.cumsum([getattr(piece, name) for piece in pieces], axis=0) for name in "Jv")
    found = []
    for count in counts:
        n = sound - count
        before, prior = (np.zeros_like(J[0]), np.zeros_like(v[0])), base_prior
        if n >= ENOUGH:
            before = (J[n - 1], v[n - 1])
            precision = base_prior.precision + before[0]
            flattened = _flattened(state, {vane: known.first(n) for vane, known in read.items()})
            score = before[1] - before[0] @ base_prior.shift + flattened
            prior = ModelPrior(base_prior.shift + np.linalg.solve(precision, score), precision)
        first = [_begun(piece, late, prior) for late, piece in enumerate(pieces[n : n + ORDER])]
        rest = [total[-1] - total[n + len(first) - 1] for total in (J, v)]
        sums = [sum((getattr(piece, name) for piece in first), start) for name, start in zip("Jv", rest, strict=True)]
        found.append(_against(state, [*first, *pieces[n + ORDER :]], (sums[0], sums[1]), prior))
    return found


def allowing_for_gusts(state: MonitorState, over: FlightInterval) -> FlightInterval:
    """The interval with a prior that allows for the bias due to gusts (``gust_correlation``)."""
    J, v = over.whole
    allowed = np.linalg.inv(over.prior.precision) + gust_correlation.gust_covariance(
        state.reference, J / len(over.pieces)
    )
    prior = over.prior._replace(precision=np.asarray(np.linalg.inv(allowed)))
    return FlightInterval(over.pieces, prior, over.whole, *marginal(J, v, prior.precision))


def _last(state: MonitorState, count: int) -> list[WhitenedBlock]:
    return list(islice(state.history.pieces, len(state.history.pieces) - count, None))


def _against(
    state: MonitorState, pieces: Sequence[WhitenedBlock], sums: tuple[Array, Array], prior: ModelPrior
) -> FlightInterval:
    """The interval of blocks whose information (D, D) and score (D,) about the reference values are ``sums``."""
    J, v = sums
    known = readings(state, pieces, prior.shift) if len(pieces) >= LONG else {}
    v = v - J @ prior.shift + _flattened(state, known)
    return FlightInterval(pieces, prior, (J, v), *marginal(J, v, prior.precision))


def _flattened(state: MonitorState, known: Mapping[str, VaneReadings]) -> Array:
    """(D,) the correction of the score for the noise of the vanes in some blocks (``vane_noise``).

    In a short interval the bias is at most half a log unit per block, and the noise cannot be estimated from it.
    """
    total = np.zeros(len(state.terms.names))
    for vane, one in known.items():
        variance, score = state.hypotheses.flattened[vane]
        if one.read.size >= LONG:
            total += one.share(variance) * one.read.size * score
    return total


def _begun(piece: WhitenedBlock, late: int, prior: ModelPrior) -> WhitenedBlock:
    """The block for a change that began ``late`` blocks before it."""
    A = piece.begun[late]
    b = piece.whitened + (A - piece.design) @ prior.shift
    return piece._replace(design=A, whitened=b, J=A.T @ A, v=A.T @ b)


class Explanations(NamedTuple):
    """Each hypothesis weighed, and the variance of the residuals by which it was."""

    each: list[Weighed]
    scale: float  # relative to the variance that was assumed in the whitening


def explained(state: MonitorState, over: FlightInterval, usual: Array) -> Explanations:
    """Each hypothesis with an allowance for its simplicity (``weigh_loosely``), by the best one's residual variance."""
    first = weights(state, over, usual)
    best = min(excess(state, over, place, weighed) for place, weighed in enumerate(first))
    scale = max(float(usual.max()), best, 1.0)
    found = []
    for hypothesis, weighed in zip(state.hypotheses.each, first, strict=True):
        one = _loosely(over, over.prior.precision, hypothesis.shift, weighed.size, scale)
        if hypothesis.whole:
            one = replace(one, factor=one.factor - LAST_RESORT * abs(one.factor))
        found.append(one)
    return Explanations(_possible(state, found), scale)


def _loosely(over: FlightInterval, precision: Array, shift: Shift, size: Array, scale: float) -> Weighed:
    """A shift weighed where a fault of about this size (m,) may differ from it."""
    return weigh_loosely(*over.whole, shift, precision, LOOSE * (shift.fixed + shift.free @ size), scale)


def sized(state: MonitorState, over: FlightInterval, found: Explanations, place: int) -> tuple[Shift, Weighed]:
    """The shift by a fault, linear about its size, and the size.

    Gusts may have biased the slopes, which matters where the mean motion is another than before the fault.
    """
    motion = np.array([piece.block.regressors for piece in over.pieces])
    mean, plain = np.zeros(len(state.terms.names)), state.terms.derivatives
    mean[plain] = (motion / motion[:, [OFFSET]]).mean(axis=0)[state.terms.column[plain]]
    offsets = gust_correlation.offset_covariance(state.reference, mean)
    precision = np.asarray(np.linalg.inv(np.linalg.inv(over.prior.precision) + offsets))
    hypothesis, weighed = state.hypotheses.each[place], found.each[place]
    for _ in range(LINEARISED):
        shift = linearised(hypothesis, weighed.size)
        weighed = _loosely(over, precision, shift, weighed.size, found.scale)
    return shift, weighed


def statistics(state: MonitorState, over: FlightInterval) -> Array:
    """(H,) the mean square score of each hypothesis; see ``bayes_factors.score_squares``."""
    return score_squares(over.J, over.v, state.hypotheses.shifts)


def weights(state: MonitorState, over: FlightInterval, usual: Array) -> list[Weighed]:
    """The Bayes factor of each hypothesis; ``usual`` (H,) is the mean of its statistic without a fault."""
    return _possible(state, weigh_each(over.J, over.v, state.hypotheses.shifts, np.maximum(usual, 1.0)))


def promising(state: MonitorState, over: FlightInterval, usual: Array, squares: Array, least: float) -> list[Weighed]:
    """As ``weights``, where only factors above ``least`` matter; ``squares`` (H,) are the interval's statistics."""
    usual = np.maximum(usual, 1.0)
    worth = most(state.hypotheses.shifts, squares, usual) > least - MARGIN
    return _possible(state, weigh_each(over.J, over.v, state.hypotheses.shifts, usual, worth))


def _possible(state: MonitorState, found: Sequence[Weighed]) -> list[Weighed]:
    """The same, where a size with a wrong sign has no support."""
    return [
        replace(weighed, factor=-math.inf) if hypothesis.one_sided and _negative(hypothesis, weighed) else weighed
        for hypothesis, weighed in zip(state.hypotheses.each, found, strict=True)
    ]


def _negative(hypothesis: Hypothesis, weighed: Weighed) -> bool:
    return bool(weighed.size.size) and float(np.array(hypothesis.measure) @ weighed.size) < 0.0


def excess(state: MonitorState, over: FlightInterval, place: int, weighed: Weighed) -> float:
    """The residual variance with a hypothesis, relative to that before: it also grows where the air becomes rougher.

    It is the largest of the six coefficients'.
    """
    shift = state.hypotheses.each[place].shift
    moved = shift.fixed + shift.free @ weighed.size + over.prior.shift
    left = np.array([piece.whitened - piece.design @ moved for piece in over.pieces])
    return float((left**2).mean(axis=0).max())


def stuck_vanes(state: MonitorState, pieces: Sequence[WhitenedBlock], counts: Sequence[int] = ()) -> Array:
    """(N, 2) log Bayes factors of jammed vanes over the last ``counts`` (N) blocks, or over all."""
    counts = counts or [len(pieces)]
    found = np.zeros((len(counts), len(VANES)))
    variances = residual_whitening.counted_variances(state.whitening)
    noise = noise_variances(state, float(np.mean([piece.block.samples for piece in pieces])), variances)
    slope, offsets = slopes(state), state.reference.offsets
    for place, (vane, (column, output)) in enumerate(VANES.items()):
        if vane in slope:
            read = np.array([piece.block.air[column] for piece in pieces])
            off = [piece.residual[output] / piece.block.regressors[OFFSET] - offsets[output] for piece in pieces]
            implied = read + np.array(off) / slope[vane]
            difference = (float(variances[output]) + _unknown_part(state, pieces, vane)) / slope[vane] ** 2
            taps = state.whitening.filter[:, output]
            factors = [stuck_factor(read[-n:], implied[-n:], taps, noise[vane], difference) for n in counts]
            found[:, place] = factors
    return found


def _unknown_part(state: MonitorState, pieces: Sequence[WhitenedBlock], vane: str) -> float:
    """Variance of what a vane's force depends on besides its angle, as far as the model does not know it."""
    mine = (state.terms.output == VANES[vane][1]) & ~state.terms.of("0") & ~state.terms.of(vane)
    known = state.hypotheses.covariance[np.ix_(mine, mine)]
    columns = state.terms.column[mine]
    regressors = np.array([piece.block.regressors[columns] / piece.block.regressors[OFFSET] for piece in pieces])
    regressors = regressors - regressors.mean(axis=0)
    return float(((regressors @ known) * regressors).sum()) / len(pieces)
