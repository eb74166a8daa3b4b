"""The fault monitor: ``init``, ``update`` with each aligned sample, ``receive_estimates`` of the identifier.

    state = init(aircraft, FaultMonitorSettings())
    fault = update(state, time, sample)        # as ``online.estimator.update`` takes it; None without a fault

Ten times a second the hypotheses are tested on intervals of the last 0.5 to 8 s against the reference model. The first
Bayes factor above the threshold raises an alarm. From then on the reference model is frozen, the onset is estimated,
and all blocks since the onset decide which fault it is and how large. The alarm ends when they or the last seconds
contradict it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.hypotheses.bayes_factors import Shifts
from sysid_node.faults.hypotheses.catalogue import hypotheses
from sysid_node.faults.hypotheses.vane_noise import VANES, noise_variances, readings, shares
from sysid_node.faults.hypotheses.weighing import (
    LONG,
    Explanations,
    FlightInterval,
    allowing_for_gusts,
    changed_since,
    excess,
    explained,
    last_interval,
    onsets,
    promising,
    sized,
    statistics,
    stuck_vanes,
    weights,
)
from sysid_node.faults.model import blocks, gust_correlation, reference_model, residual_whitening
from sysid_node.faults.model.blocks import PERIOD, Block
from sysid_node.faults.model.instrument_noise import least_variances
from sysid_node.faults.model.reference_model import IdentifierEstimates, ModelPrior
from sysid_node.faults.model.residual_whitening import ORDER
from sysid_node.faults.model.terms import Terms, design_of, terms
from sysid_node.faults.report import Detection, fault_of
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.state import LAG, SPANS, Alarm, FaultHypotheses, MonitorState, WhitenedBlock
from sysid_node.faults.types import DAMAGE, VANE_STUCK, Fault
from sysid_node.online.frequency.regression_signals import OFFSET

Array = NDArray[np.float64]

EVERY = 5  # a span of n times so many blocks is tested at every n-th block
EXPLAINED = 0.9  # least R^2 of a coefficient that is learned from
PATIENT = 20  # blocks for which a vane must have been still
LEAST = 3  # blocks that a fault must have lasted
RENEWED = 10  # blocks between updates of hypotheses and whitening
SETTLED = 0.5  # share of the learning time, after which the whitening is good enough to learn the model
OFFSETS = 30.0  # s over which offsets are learned
USUAL = 60.0  # s, time constant of a statistic's mean
DATED = 5.0  # s after an alarm in which its onset is estimated
MUCH, LITTLE = 0.2, 1.5  # share of the largest log Bayes factor; multiple of the least residual energy
LIKELY = 0.9  # share of the largest log Bayes factor that an onset has with one of the hypotheses
CHANCE = 10.0  # residual energy due to chance, in units of a block's noise energy
CONTRADICTED = 3.0  # log likelihood ratio
OUTLIER = 10.0  # statistics enter their mean with at most this value


def init(aircraft: Aircraft, settings: FaultMonitorSettings) -> MonitorState:
    """A monitor before the first sample."""
    made = blocks.init(aircraft)
    known = terms(aircraft, made.layout)
    whitening = residual_whitening.init(settings.memory, PERIOD)
    return MonitorState(aircraft, settings, known, made, reference_model.init(known), whitening)


def receive_estimates(state: MonitorState, time: float, known: IdentifierEstimates) -> None:
    """Take the identifier's estimates at a time (s, as the samples')."""
    if state.alarm is None:
        reference_model.receive_estimates(state.reference, time, known)


def update(state: MonitorState, time: float, sample: Sequence[float]) -> Fault | None:
    """Take a sample; returns the present fault, or None."""
    block = blocks.add(state.blocks, time, sample)
    if block is not None:
        take(state, block)
    return state.fault


def take(state: MonitorState, block: Block) -> None:
    """Take a block."""
    history = state.history
    if not block.follows:
        if history.latest is not None and _learning(state):
            # the last blocks before a gap are never learned from, nor the first after it
            history.lost += min(len(history.pieces), LAG) + ORDER
        history.raw.clear()
        history.pieces.clear()
    design, residual = _compare_with_reference(state, block)
    history.count, history.latest = history.count + 1, block
    learning = _learning(state)
    if learning:
        _learn(state, block, residual)
        if history.count % RENEWED == 0:
            _settle(state, block)
    if len(history.raw) == ORDER:
        piece = _piece(state, block, design, residual)
        history.pieces.append(piece)
        if not learning:
            _judge(state, piece)
        elif learned(state) > SETTLED * state.settings.learning:
            _learn_model(state)
    history.raw.append(_compare_with_reference(state, block))


def _settle(state: MonitorState, now: Block) -> None:
    """Compute the whitening anew, with no less noise than the instruments have."""
    state.whitening.least = least_variances(state.aircraft, now.samples, PERIOD)
    residual_whitening.settle(state.whitening)


def learned(state: MonitorState) -> float:
    """Seconds of flight that count as learned from. Gaps during learning prolong it."""
    return (state.history.count - state.history.lost) * PERIOD


def _learning(state: MonitorState) -> bool:
    return learned(state) <= state.settings.learning


def _compare_with_reference(state: MonitorState, block: Block) -> tuple[Array, Array]:
    """The regressors of a block by term (6, D), and its residual (6,) of the reference model."""
    design = design_of(state.terms, state.reference.values, block.regressors, block.behind)
    return design, block.outputs - design @ state.reference.values


def _piece(state: MonitorState, block: Block, design: Array, residual: Array) -> WhitenedBlock:
    """The whitened block."""
    k = block.regressors[OFFSET]
    off = residual - k * state.reference.offsets
    designs = [design]
    for (earlier, before), share in zip(reversed(state.history.raw), state.whitening.filter, strict=True):
        designs.append(designs[-1] - share[:, None] * earlier)
        off = off - share * (before - k * state.reference.offsets)
    *begun, A = (state.whitening.unmix @ one for one in designs)
    b = state.whitening.unmix @ off
    return WhitenedBlock(block, residual, A, tuple(begun), b, A.T @ A, A.T @ b)


def _judge(state: MonitorState, piece: WhitenedBlock) -> None:
    if state.alarm is not None:
        if state.history.count % EVERY == 0:
            _follow(state, state.alarm)
        return
    if state.history.count % RENEWED == 0 or state.renewed is None:
        _renew(state, piece.block)
    _watch(state)
    if state.alarm is None and len(state.history.pieces) > LAG:
        old = state.history.pieces[-LAG - 1]
        _learn(state, old.block, old.residual)
        _learn_model(state)


def _learn(state: MonitorState, block: Block, residual: Array) -> None:
    """Learn autocorrelation, offsets and mean regressors from a block without a fault."""
    residual_whitening.learn(state.whitening, residual, block.follows)
    known = state.reference
    weight = max(PERIOD / OFFSETS, 1.0 / (state.history.count or 1))
    known.offsets += weight * (residual / block.regressors[OFFSET] - known.offsets)
    plain = state.terms.derivatives
    known.regressors[plain] += weight * (block.regressors[state.terms.column[plain]] - known.regressors[plain])


def _learn_model(state: MonitorState) -> None:
    """Learn the terms of the coefficients with a large R^2, from the block that is old enough.

    In closed loop the surfaces respond to gusts. Where gusts cause most of the motion, least squares are biased (Ljung,
    "System Identification", 2nd ed. (1999), sect. 13.4), and R^2 is small.
    """
    if len(state.history.pieces) <= LAG:
        return
    if state.history.count % RENEWED == 0 or not state.explained.size:
        last = list(islice(state.history.pieces, len(state.history.pieces) - LAG - 1, None))
        state.explained = _explained(state.terms, [piece.block for piece in last])
        shift = state.renewed.prior.shift if state.renewed else np.zeros(len(state.terms.names))
        state.noisy = shares(readings(state, last[:LONG], shift), _vane_noise(state, last[0].block))
    old = state.history.pieces[-LAG - 1]
    reference_model.learn(state.reference, old.J, old.v, state.explained, state.noisy)


def _vane_noise(state: MonitorState, now: Block) -> dict[str, float]:
    """Variance (rad^2) of each vane's noise in a block."""
    return noise_variances(state, now.samples, residual_whitening.variances(state.whitening))


def _explained(terms: Terms, last: Sequence[Block]) -> NDArray[np.bool_]:
    """(D,) the terms of the coefficients whose regression on their regressors has a large R^2 in these blocks.

    A servo's terms enter several coefficients, and are learned where all of these have.
    """
    names = "outputs", "regressors", "behind"
    outputs, regressors, behind = (np.array([getattr(block, name) for block in last]) for name in names)
    found = np.zeros(len(terms.names), dtype=bool)
    for output in terms.coefficients:
        mine = terms.output == output
        lagged = [terms.column[servo] for servo, derivatives in terms.servos.values() if mine[derivatives].any()]
        y = outputs[:, output] - outputs[:, output].mean()
        X = np.column_stack([regressors[:, terms.column[mine]], *(behind[:, columns] for columns in lagged)])
        X = X - X.mean(axis=0)
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
        found[mine] = left @ left < (1.0 - EXPLAINED) * (y @ y)
    for servo, derivatives in terms.servos.values():
        found[servo] = found[derivatives].all()
    return found


def _renew(state: MonitorState, now: Block) -> None:
    """Update reference model, prior and hypotheses by what has been learned."""
    _settle(state, now)
    if reference_model.adopt_estimates(state.reference, now.time):
        _rebuild(state)
    variances = _vane_noise(state, now)
    noise = {
        vane: reference_model.noise_of(state.terms, state.whitening, vane, variance)
        for vane, variance in variances.items()
    }
    learned_noise = sum(
        (noise[vane] * count for vane, count in state.reference.noisy.items()), np.zeros_like(state.reference.J)
    )
    prior = reference_model.model_prior(state.reference, learned_noise, state.settings.slack)
    believed = state.reference.values + prior.shift
    commanded = reference_model.commanded(state.reference)
    each = hypotheses(state.aircraft, state.terms, reference_model.whole(state.reference, prior.shift), commanded)
    if state.renewed is not None and len(each) != len(state.renewed.each):
        state.usual.clear()  # it is known only now which controls are commanded
    state.renewed = FaultHypotheses(
        each,
        Shifts([hypothesis.shift for hypothesis in each]),
        prior,
        np.asarray(np.linalg.inv(prior.precision)),
        {vane: (variances[vane], added @ believed) for vane, added in noise.items()},
    )


def _rebuild(state: MonitorState) -> None:
    """Whiten the last blocks again, with new reference values; the first ones, whose past is lost, are dropped."""
    history = state.history
    last = [piece.block for piece in history.pieces]
    history.pieces.clear()
    history.raw.clear()
    for block in last:
        design, residual = _compare_with_reference(state, block)
        if len(history.raw) == ORDER:
            history.pieces.append(_piece(state, block, design, residual))
        history.raw.append((design, residual))
    history.raw.pop()  # ``take`` adds the newest


def _watch(state: MonitorState) -> None:
    """Test the spans that are due for a fault."""
    new = state.usual[-1].copy() if state.usual else np.ones((len(SPANS), len(state.hypotheses.each)))
    for row, span in enumerate(SPANS):
        if state.history.count % max(span // EVERY, 1) or span > len(state.history.pieces):
            continue
        over = last_interval(state, span)
        usual = state.usual[-span - 1][row] if span < len(state.usual) else new[row]
        squares = statistics(state, over)
        if _proven(state, over, usual, squares) > state.settings.threshold:
            _alarm(state, over, usual)
            return
        share = max(span // EVERY, 1) * PERIOD / USUAL
        new[row] += share * (np.minimum(squares, OUTLIER) - new[row])
    state.usual.append(new)


def _proven(state: MonitorState, over: FlightInterval, usual: Array, squares: Array) -> float:
    """The largest log Bayes factor; large ones are computed with the variance of the interval's own residuals."""
    threshold = state.settings.threshold
    whole = np.array([hypothesis.whole for hypothesis in state.hypotheses.each])
    usual = gust_correlation.usual_size_in_gusts(whole, usual, len(over.pieces))
    found = promising(state, over, usual, squares, threshold)
    best = float(stuck_vanes(state, over.pieces).max()) if len(over.pieces) >= PATIENT else 0.0
    if any(weighed.factor > threshold for weighed in found):
        over = allowing_for_gusts(state, over)
        found = weights(state, over, usual)
    for place, weighed in enumerate(found):
        if weighed.factor > threshold:
            left = max(excess(state, over, place, weighed), float(usual[place]))
            best = max(best, weighed.factor * float(usual[place]) / left)
    return best


def _alarm(state: MonitorState, over: FlightInterval, usual: Array) -> None:
    """Raise an alarm."""
    pieces = state.history.pieces
    earliest = pieces[-min(len(pieces), LAG)].block.time - PERIOD
    state.alarm = Alarm(over.pieces[-1].block.time, earliest, earliest, usual, over.prior)
    _follow(state, state.alarm)


def _follow(state: MonitorState, alarm: Alarm) -> None:
    """Compare the hypotheses on all blocks since the onset; end the alarm where they or the last seconds contradict it.

    Damage explains the first blocks as well as a failed surface does, so that it is reported only after more blocks.
    Once the onset is no longer among the blocks, the fault keeps its name, and stands while nothing moves that would
    show it.
    """
    pieces = state.history.pieces
    if len(pieces) < LEAST:
        return  # after a gap
    now = pieces[-1].block.time
    if now - alarm.found <= DATED:
        alarm.since, alarm.prior = _onset(state, alarm)
    over = changed_since(state, min(max(_since(state, alarm.since), LEAST), len(pieces)), alarm.prior)
    found = explained(state, over, alarm.usual)
    factors = np.array([*(w.factor for w in found.each), *stuck_vanes(state, over.pieces)[0]])
    remembered = pieces[0].block.time <= alarm.since + PERIOD
    if remembered:
        alarm.place = int(np.argmax(factors))
    if (remembered and factors[alarm.place] > 0.0) or factors[alarm.place] > state.settings.threshold:
        _name(state, alarm, over, found, factors)
    if now - alarm.found > LAG * PERIOD and ((remembered and factors.max() <= 0.0) or _contradicted(state, alarm)):
        state.alarm = state.fault = None
        state.history.pieces.clear()
        state.usual.clear()


def _name(state: MonitorState, alarm: Alarm, over: FlightInterval, found: Explanations, factors: Array) -> None:
    """Report the fault at the alarm's place among the hypotheses, which are ``found``, and the stuck vanes."""
    place = alarm.place
    times = Detection(min(alarm.since, alarm.found), alarm.found, _sure(state, factors, place))
    if place >= len(found.each):
        alarm.shift = None
        state.fault = Fault(VANE_STUCK, list(VANES)[place - len(found.each)], *(math.nan,) * 3, "", *times)
        return
    hypothesis = state.hypotheses.each[place]
    shift, weighed = sized(state, over, found, place)
    alarm.shift = shift.fixed + shift.free @ weighed.size
    if hypothesis.kind != DAMAGE or state.history.pieces[-1].block.time - alarm.found > (EVERY - 0.5) * PERIOD:
        state.fault = fault_of(hypothesis, weighed, state.terms, times)


def _sure(state: MonitorState, factors: Array, place: int) -> float:
    """The posterior probability of a fault: of all hypotheses with the same kind and part."""
    names = [*((h.kind, h.part) for h in state.hypotheses.each), *((VANE_STUCK, vane) for vane in VANES)]
    share = np.exp(factors - factors[place])
    return float(share[[name == names[place] for name in names]].sum() / share.sum())


def _since(state: MonitorState, time: float) -> int:
    """The number of blocks since a time (s)."""
    return sum(piece.block.time > time + 0.5 * PERIOD for piece in state.history.pieces)


def _onset(state: MonitorState, alarm: Alarm) -> tuple[float, ModelPrior]:
    """The onset (s) and the prior at it: the maximum of the likelihood over the onset.

    Hypotheses with many parameters also explain blocks before the change, so that their onset is too early, and much
    residual energy is left after it. Of the onsets that the well supported hypotheses have, and that are about as
    likely as the best one, the earliest is taken that leaves little. The energy alone cannot decide: once the first
    blocks after the change are in the prior, the following ones agree with it.
    """
    latest = max(_since(state, alarm.found), LEAST)
    counts = range(latest, max(_since(state, alarm.earliest), latest) + 1)
    spans = onsets(state, counts, counts[-1])

    def at(place: int) -> tuple[float, ModelPrior]:
        return state.history.pieces[-counts[place]].block.time - PERIOD, spans[place].prior

    factors = np.array([[w.factor for w in weights(state, over, alarm.usual)] for over in spans])
    vanes = stuck_vanes(state, spans[-1].pieces, counts)
    if vanes.max() > factors.max():
        return at(int(vanes.max(axis=1).argmax()))
    if not factors.max() > 0.0:
        return alarm.since, alarm.prior
    much = factors.max(axis=0) > MUCH * factors.max()
    likely = factors.max(axis=1) >= LIKELY * factors.max()
    best = [i for i in sorted(set(factors[:, much].argmax(axis=0).tolist()), reverse=True) if likely[i]]
    left = [_left(state, spans[i], alarm.usual) for i in best]
    return at(next(i for i, rest in zip(best, left, strict=True) if rest <= LITTLE * min(left)))


def _left(state: MonitorState, over: FlightInterval, usual: Array) -> float:
    """The least residual energy above the noise's of all hypotheses in an interval, plus an allowance for chance."""
    found = enumerate(weights(state, over, usual))
    share = min(excess(state, over, place, weighed) for place, weighed in found)
    return max(share - 1.0, 0.0) * len(over.pieces) + CHANCE


def _contradicted(state: MonitorState, alarm: Alarm) -> bool:
    """Whether the last seconds are much likelier without the fault, as large as it was found, than with it."""
    over = last_interval(state, min(LAG, len(state.history.pieces)), alarm.prior)
    if alarm.shift is None:
        return bool(stuck_vanes(state, over.pieces)[0, alarm.place - len(state.hypotheses.each)] < 0.0)
    return bool(alarm.shift @ over.v - 0.5 * alarm.shift @ over.J @ alarm.shift < -CONTRADICTED)
