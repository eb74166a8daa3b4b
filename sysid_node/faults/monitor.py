"""The fault monitor: ``init``, ``update`` with every aligned sample, ``hear`` the identifier's estimates.

    state = init(aircraft, Settings())
    fault = update(state, time, sample)        # as ``online.estimator.update`` takes it; None while nothing is wrong

Ten times a second the last half to eight seconds are weighed against the model that is held (``evidence``). The first
Bayes factor beyond the threshold is an alarm. From then on all that is learned is held, the fault's onset is where the
evidence begins, and all that has come since is weighed anew: which fault, how large. When the last seconds no longer
speak of it, the alarm ends.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.hypotheses.bayes_factors import Shifts
from sysid_node.faults.hypotheses.catalogue import hypotheses
from sysid_node.faults.hypotheses.weighing import (
    VANES,
    FlightInterval,
    allowing_for_gusts,
    changed_since,
    excess,
    explained,
    last_interval,
    onsets,
    promising,
    statistics,
    stuck_vanes,
    vane_noise,
    weights,
)
from sysid_node.faults.model import blocks, gust_correlation, reference_model, residual_whitening
from sysid_node.faults.model.blocks import PERIOD, Block
from sysid_node.faults.model.reference_model import IdentifierEstimate, ModelPrior
from sysid_node.faults.model.residual_whitening import ORDER
from sysid_node.faults.model.terms import Terms, terms
from sysid_node.faults.report import Detection, fault_of
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.state import LAG, SPANS, Alarm, MonitorState, WhitenedBlock
from sysid_node.faults.types import DAMAGE, VANE_STUCK, Fault
from sysid_node.online.frequency.regression_signals import OFFSET

Array = NDArray[np.float64]

EVERY = 5  # a span of n times so many blocks is looked at with every n-th block
EXPLAINED = 0.9  # share of a coefficient's motion, for it to be learned from
PATIENT = 20  # blocks that a vane must have stood still
LEAST = 3  # blocks that a fault must have lasted
RENEWED = 10  # blocks after which hypotheses and whitening are made anew
SETTLED = 0.5  # share of the learning, after which the residuals' colour is known well enough to learn by
OFFSETS = 30.0  # s over which offsets are learned
USUAL = 60.0  # s over which the usual size of a statistic is
DATED = 5.0  # s after an alarm in which its onset is sought
MUCH, LITTLE = 0.2, 1.5  # share of the largest Bayes factor's logarithm; times the least energy left
CHANCE = 10.0  # energy, in that of a block's noise, that chance may leave more or less
OUTLIER = 10.0  # a statistic beyond this is no usual one


def init(aircraft: Aircraft, settings: FaultMonitorSettings) -> MonitorState:
    """A monitor that has seen nothing."""
    made = blocks.init(aircraft)
    known = terms(aircraft, made.layout)
    colour = residual_whitening.init(settings.memory, PERIOD)
    return MonitorState(aircraft, settings, known, made, reference_model.init(known), colour)


def receive_estimates(state: MonitorState, time: float, known: Mapping[str, IdentifierEstimate]) -> None:
    """The identifier's estimates at a time (s, as of the samples)."""
    if state.alarm is None:
        reference_model.receive_estimates(state.held, time, known)


def update(state: MonitorState, time: float, sample: Sequence[float]) -> Fault | None:
    """Take in a sample; returns what is wrong at present."""
    block = blocks.add(state.blocks, time, sample)
    if block is not None:
        take(state, block)
    return state.fault


def take(state: MonitorState, block: Block) -> None:
    """Take in a block."""
    if not block.follows:
        state.raw.clear()
        state.pieces.clear()
    design, residual = _against_held(state, block)
    state.count += 1
    learning = state.count * PERIOD <= state.settings.learning
    if learning:
        _learn(state, block, residual)
        if state.count % RENEWED == 0:
            residual_whitening.settle(state.colour)
    if len(state.raw) == ORDER:
        piece = _piece(state, block, design, residual)
        state.pieces.append(piece)
        if not learning:
            _judge(state, piece)
        elif state.count * PERIOD > SETTLED * state.settings.learning:
            _learn_model(state)
    state.raw.append(_against_held(state, block))


def _against_held(state: MonitorState, block: Block) -> tuple[Array, Array]:
    """A block's regressors by term (6, D), and its residual (6,) against the held values."""
    design = np.zeros((6, len(state.terms.names)))
    design[state.terms.output, np.arange(design.shape[1])] = block.regressors[state.terms.column]
    return design, block.outputs - design @ state.held.values


def _piece(state: MonitorState, block: Block, design: Array, residual: Array) -> WhitenedBlock:
    """The block, whitened."""
    k = block.regressors[OFFSET]
    off = residual - k * state.held.offsets
    designs = [design]
    for (earlier, before), share in zip(reversed(state.raw), state.colour.filter, strict=True):
        designs.append(designs[-1] - share[:, None] * earlier)
        off = off - share * (before - k * state.held.offsets)
    *begun, A = (state.colour.unmix @ one for one in designs)
    b = state.colour.unmix @ off
    return WhitenedBlock(block, residual, A, tuple(begun), b, A.T @ A, A.T @ b)


def _judge(state: MonitorState, piece: WhitenedBlock) -> None:
    if state.alarm is not None:
        if state.count % EVERY == 0:
            _follow(state, state.alarm)
        return
    if state.count % RENEWED == 0 or not state.hypotheses:
        _renew(state, piece.block)
    _watch(state)
    if state.alarm is None and len(state.pieces) > LAG:
        old = state.pieces[-LAG - 1]
        _learn(state, old.block, old.residual)
        _learn_model(state)


def _learn(state: MonitorState, block: Block, residual: Array) -> None:
    """From a block of sound flight."""
    residual_whitening.learn(state.colour, residual, block.follows)
    known = state.held
    weight = max(PERIOD / OFFSETS, 1.0 / (state.count or 1))
    known.offsets += weight * (residual / block.regressors[OFFSET] - known.offsets)
    known.regressors += weight * (block.regressors[state.terms.column] - known.regressors)


def _learn_model(state: MonitorState) -> None:
    """From the block that is old enough, the coefficients whose motion the model explains in the time after it.

    In a closed loop surfaces answer to gusts, and where gusts make the motion least squares are biased by that (Ljung,
    "System Identification", 2nd ed. (1999), sect. 13.4).
    """
    if len(state.pieces) <= LAG:
        return
    if state.count % RENEWED == 0 or not state.explained.size:
        last = islice(state.pieces, len(state.pieces) - LAG - 1, None)
        state.explained = _explained(state.terms, [piece.block for piece in last])
    old = state.pieces[-LAG - 1]
    reference_model.learn(state.held, old.J, old.v, state.explained)


def _explained(terms: Terms, last: Sequence[Block]) -> NDArray[np.bool_]:
    """(D,) terms of the coefficients whose motion their regressors explain, whatever the derivatives."""
    outputs, regressors = (np.array([getattr(b, name) for b in last]) for name in ("outputs", "regressors"))
    found = np.zeros(len(terms.names), dtype=bool)
    for output in set(terms.output.tolist()):
        mine = terms.output == output
        y = outputs[:, output] - outputs[:, output].mean()
        X = regressors[:, terms.column[mine]]
        X = X - X.mean(axis=0)
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
        found[mine] = left @ left < (1.0 - EXPLAINED) * (y @ y)
    return found


def _renew(state: MonitorState, now: Block) -> None:
    """What is held, and how it could fail, from what has been learned."""
    residual_whitening.settle(state.colour)
    if reference_model.adopt_estimates(state.held, now.time):
        _rebuild(state)
    variances = vane_noise(state, now.samples)
    noise = {
        vane: reference_model.noise_of(state.terms, state.colour, vane, variance)
        for vane, variance in variances.items()
    }
    state.belief = reference_model.model_prior(
        state.held, sum(noise.values()) * state.held.blocks, state.settings.slack
    )
    believed = state.held.values + state.belief.shift
    state.flattened = {vane: (variances[vane], added @ believed) for vane, added in noise.items()}
    state.hypotheses = hypotheses(state.aircraft, state.terms, reference_model.whole(state.held, state.belief.shift))
    state.shifts = Shifts([hypothesis.shift for hypothesis in state.hypotheses])


def _rebuild(state: MonitorState) -> None:
    """Make the last pieces anew, against other values; the first ones go, whose past is not known any more."""
    last = [piece.block for piece in state.pieces]
    state.pieces.clear()
    state.raw.clear()
    for block in last:
        design, residual = _against_held(state, block)
        if len(state.raw) == ORDER:
            state.pieces.append(_piece(state, block, design, residual))
        state.raw.append((design, residual))
    state.raw.pop()  # ``take`` adds the newest


def _watch(state: MonitorState) -> None:
    """Look for a fault in the spans that are due."""
    new = state.usual[-1].copy() if state.usual else np.ones((len(SPANS), len(state.hypotheses)))
    for row, span in enumerate(SPANS):
        if state.count % max(span // EVERY, 1) or span > len(state.pieces):
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
    """The largest logarithm of a Bayes factor; those that may matter with the residuals' own variance."""
    threshold = state.settings.threshold
    whole = np.array([hypothesis.whole for hypothesis in state.hypotheses])
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
    """Something has failed."""
    now, earliest = over.pieces[-1].block.time, state.pieces[-min(len(state.pieces), LAG)].block.time - PERIOD
    state.alarm = Alarm(now, earliest, earliest, usual, over.belief)
    _follow(state, state.alarm)


def _follow(state: MonitorState, alarm: Alarm) -> None:
    """Weigh what has come since the onset; end the alarm where the last seconds speak of nothing.

    Damage explains any single moment as well as the surface that made it: it is not said before more has come.
    """
    if len(state.pieces) < LEAST:
        return  # after a gap
    now = state.pieces[-1].block.time
    if now - alarm.found <= DATED:
        alarm.since, alarm.belief = _onset(state, alarm)
    over = changed_since(state, min(max(_since(state, alarm.since), LEAST), len(state.pieces)), alarm.belief)
    found = explained(state, over, alarm.usual)
    factors = np.array([*(w.factor for w in found), *stuck_vanes(state, over.pieces)[0]])
    place = int(np.argmax(factors))
    times = Detection(min(alarm.since, alarm.found), alarm.found, _sure(state, factors, place))
    if place >= len(found):
        state.fault = Fault(VANE_STUCK, list(VANES)[place - len(found)], *(math.nan,) * 3, "", *times)
    elif state.hypotheses[place].kind != DAMAGE or now - alarm.found > (EVERY - 0.5) * PERIOD:
        state.fault = fault_of(state.hypotheses[place], found[place], state.terms, times)
    if now - alarm.found > LAG * PERIOD and _over(state, place, alarm):
        state.alarm = state.fault = None
        state.pieces.clear()
        state.usual.clear()


def _sure(state: MonitorState, factors: Array, place: int) -> float:
    """The probability of a hypothesis among all, together with those that are called the same."""
    names = [*((h.kind, h.part) for h in state.hypotheses), *((VANE_STUCK, vane) for vane in VANES)]
    share = np.exp(factors - factors[place])
    return float(share[[name == names[place] for name in names]].sum() / share.sum())


def _since(state: MonitorState, time: float) -> int:
    """Blocks since a time (s)."""
    return sum(piece.block.time > time + 0.5 * PERIOD for piece in state.pieces)


def _onset(state: MonitorState, alarm: Alarm) -> tuple[float, ModelPrior]:
    """Since when (s), and what is believed then: the likelihood's maximum over the onset, of what explains the rest.

    One with much freedom explains the moment of the change, too, and so sets in too early: of the hypotheses that
    explain much, the earliest onset counts from which on little is left to be explained.
    """
    latest = max(_since(state, alarm.found), LEAST)
    counts = range(latest, max(_since(state, alarm.earliest), latest) + 1)
    spans = onsets(state, counts, counts[-1])

    def at(place: int) -> tuple[float, ModelPrior]:
        return state.pieces[-counts[place]].block.time - PERIOD, spans[place].belief

    factors = np.array([[w.factor for w in weights(state, over, alarm.usual)] for over in spans])
    vanes = stuck_vanes(state, spans[-1].pieces, counts)
    if vanes.max() > factors.max():
        return at(int(vanes.max(axis=1).argmax()))
    if not factors.max() > 0.0:
        return alarm.since, alarm.belief
    much = factors.max(axis=0) > MUCH * factors.max()
    best = sorted(set(factors[:, much].argmax(axis=0).tolist()), reverse=True)
    left = [_left(state, spans[i], alarm.usual) for i in best]
    return at(next(i for i, rest in zip(best, left, strict=True) if rest <= LITTLE * min(left)))


def _left(state: MonitorState, over: FlightInterval, usual: Array) -> float:
    """The least energy beyond the noise's that a hypothesis leaves in a stretch, and what chance may make of it."""
    found = enumerate(weights(state, over, usual))
    share = min(excess(state, over, place, weighed) for place, weighed in found)
    return max(share - 1.0, 0.0) * len(over.pieces) + CHANCE


def _over(state: MonitorState, place: int, alarm: Alarm) -> bool:
    """Whether the last seconds speak against the fault."""
    over = last_interval(state, min(LAG, len(state.pieces)), alarm.belief)
    factors = [*(w.factor for w in weights(state, over, alarm.usual)), *stuck_vanes(state, over.pieces)[0]]
    return bool(factors[place] < 0.0)
