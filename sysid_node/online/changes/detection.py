"""Abrupt changes of the aircraft, and flight that the estimates do not explain.

The transforms of the last seconds are kept in pieces. Each time a piece is complete, stretches of 1.5 s and more that
end in it are tested against the estimates from before them (``contradiction``): the generalised likelihood ratio over
the time of change (Basseville & Nikiforov, "Detection of Abrupt Changes", 1993, sec. 7.2).

What is unlikely to be chance casts doubt: estimates that the last seconds contradict are not valid. What cannot be
chance in an hour of flight ends them: all is learned anew from the time of change. It is announced as a change of the
aircraft if earlier manoeuvres are contradicted as surely (``experience``); else the estimates were at fault. Residuals
that no derivatives explain are another matter: there the model itself does not hold (near the stall, say).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.changes.excited_segments import ExcitedSegments, estimates_of
from sysid_node.online.changes.score_test import Reference, ScoreTest, disagreement, score_test
from sysid_node.online.regression.information import Spectrum, clean_lines
from sysid_node.online.regression.instruments import InstrumentModel
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

PIECE = 0.5  # s
SPANS = (3, 6, 12, 24)  # pieces looked back over
EVERY = 3  # a span of n times so many pieces is looked at with every n-th piece
FALSE_ALARM = 1e-9  # a test: an hour has 7200 pieces, times six coefficients and about two spans
MARGIN = 1.5  # and F must exceed what chance allows by this factor: no model is exact
DOUBT = 1e-2  # chance under which a span casts doubt
KNOWN = 12.0  # degrees of freedom that the earlier estimates must rest on
LOST = 0.25  # share of the motion's energy left unexplained beyond which the model does not hold
NOISE_RATIO = 9.0  # and by how much the residual must stand above its usual density
USUAL = 3  # pieces in the span by which the usual size of F is judged
LEARNING = 0.02  # weight of each new F in that judgement
AS_MUCH = 0.9  # share of the largest contradiction that is about as much
OUTLIER = 10.0  # an F beyond this is no usual one


@dataclass
class ChangeMonitor:
    """The last pieces of the transform, the estimates that belong to their starts, and what was found of the spans."""

    pieces: deque[tuple[float, Array]] = field(default_factory=lambda: deque(maxlen=SPANS[-1]))  # start, (2F+1, W)
    references: deque[Reference] = field(default_factory=lambda: deque(maxlen=SPANS[-1] + 1))
    usual: deque[Array] = field(default_factory=lambda: deque(maxlen=SPANS[-1] + 1))  # (C,) F where nothing changes
    doubted: dict[int, Flags] = field(default_factory=dict)  # (C,) by span
    lost: Flags | None = None  # (C,)
    disowned: Flags | None = None  # (C,) by what was learned in well-excited flight
    looks: int = 0


@dataclass(frozen=True)
class ChangeDecision:
    """What the last seconds say of each coefficient (C,), and since when (s) all must be learned anew, if it must."""

    doubted: Flags
    lost: Flags
    since: float | None = None
    changed: bool = False  # whether it is the aircraft that has changed


@dataclass(frozen=True)
class ChangeTests:
    """What all tests of one time share."""

    full: NormalEquations
    model: InstrumentModel | None
    spectrum: Spectrum
    watch: ChangeMonitor
    now: float
    memory: float  # s, inf = nothing is forgotten

    def lines(self, span: int) -> tuple[float, Array]:
        """Start (s) and clean lines of the last ``span`` pieces."""
        return self.watch.pieces[-span][0], clean_lines(_summed(self.watch.pieces, span), self.model)

    def contradictions(self, spans: Iterable[int]) -> Iterator[tuple[int, ScoreTest]]:
        """How the last pieces contradict the estimates from before them: of the ``spans`` (rising) that have such."""
        known = list(_stretches(self.watch, self.watch.pieces, self.now, spans))
        return zip(spans, _tested(known, self.model, self.spectrum), strict=False)


class _Stretch(NamedTuple):
    """One or several pieces in a row, and the estimates from before them."""

    start: float  # s
    end: float
    part: Array  # (2F + 1, W) transform
    before: Reference


def _summed(pieces: Sequence[tuple[float, Array]], span: int) -> Array:
    """(2F + 1, W) transform of the last ``span`` pieces."""
    return np.asarray(sum(piece for _, piece in islice(pieces, len(pieces) - span, None)))


def _stretches(
    watch: ChangeMonitor, pieces: Sequence[tuple[float, Array]], end: float, spans: Iterable[int]
) -> Iterator[_Stretch]:
    """The last of the ``pieces``, up to ``end`` (s): of the ``spans`` up to the first without estimates before it."""
    for span in spans:
        start = pieces[-span][0] if span <= len(pieces) else -math.inf
        reference = next((r for r in reversed(watch.references) if r.time <= start + 1e-6), None)
        if reference is None:
            return
        yield _Stretch(start, end, _summed(pieces, span), reference)


def _tested(stretches: Sequence[_Stretch], model: InstrumentModel | None, spectrum: Spectrum) -> Iterator[ScoreTest]:
    """How each contradicts the estimates from before it; those by the same equations at once."""
    for _, some in groupby(stretches, key=lambda stretch: id(stretch.before.plan)):
        starts, ends, parts, references = zip(*some, strict=True)
        lines, duration = clean_lines(np.array(parts), model), np.array(ends) - np.array(starts)
        yield from score_test(Reference.stacked(references), lines, spectrum, duration).each()


def _due(look: int) -> list[int]:
    """The spans that are looked at with the look of this number."""
    return [span for span in SPANS if not look % max(span // EVERY, 1)]


def examine(looking: ChangeTests, experiences: list[ExcitedSegments]) -> ChangeDecision:
    """Test the spans that are due; see the module's text."""
    watch, C = looking.watch, len(looking.full.coefficients)
    watch.looks += 1
    surest = 1.0
    for span, found in looking.contradictions(_due(watch.looks)):
        known = found.freedom >= KNOWN
        usual = _usual(watch, span, C)
        watch.doubted[span] = known & (found.chance(usual) < DOUBT)
        surest = min(surest, float(np.where(known, found.chance(MARGIN * usual), 1.0).min()))
        if span == USUAL:
            watch.lost = known & (found.share > LOST) & (found.unexplained > NOISE_RATIO)
            _get_used_to(watch, found, C)
    none = np.zeros(C, dtype=bool)
    doubted = np.any([none if watch.disowned is None else watch.disowned, *watch.doubted.values()], axis=0)
    lost = none if watch.lost is None else watch.lost
    if surest >= FALSE_ALARM:
        return ChangeDecision(doubted, lost)
    span = _onset(looking)
    changed = any(_contradicted(looking, span, experience, block) for block, experience in enumerate(experiences))
    # the change fell somewhere in the oldest piece: what came after it is all new
    return ChangeDecision(doubted, lost, watch.pieces[1 - span][0], changed)


def _usual(watch: ChangeMonitor, span: int, C: int) -> Array:
    """(C,) the usual F before the last ``span`` pieces, at least 1."""
    return watch.usual[-span] if span <= len(watch.usual) else np.ones(C)


def _get_used_to(watch: ChangeMonitor, found: ScoreTest, C: int) -> None:
    """Where models are not exact F is usually more than chance makes it."""
    last = watch.usual[-1] if watch.usual else np.ones(C)
    watch.usual.append(np.maximum(last + LEARNING * (np.minimum(found.statistic, OUTLIER) - last), 1.0))


def _onset(looking: ChangeTests) -> int:
    """Pieces since the change: the shortest span that contradicts about as much as any."""
    every = looking.contradictions(range(SPANS[0], len(looking.watch.pieces) + 1))
    quadratics = [float((found.statistic * found.count)[found.freedom >= KNOWN].max(initial=0.0)) for _, found in every]
    return SPANS[0] + int(np.argmax(np.array(quadratics) >= AS_MUCH * max(quadratics)))


def _contradicted(looking: ChangeTests, span: int, experience: ExcitedSegments, block: int) -> bool:
    """Whether the last ``span`` pieces contradict earlier manoeuvres that moved the controls as much."""
    start, lines = looking.lines(span)
    reference = estimates_of(experience, looking.full, looking.now - looking.memory, start)
    if reference is None or experience.beyond((lines[:, experience.controls] ** 2).sum(axis=0)):
        return False
    found = score_test(reference, lines, looking.spectrum, looking.now - start)
    mine = (looking.full.block == block) & (found.freedom >= KNOWN)
    return bool((found.chance(MARGIN)[mine] < FALSE_ALARM).any())


def compare(full: NormalEquations, watch: ChangeMonitor, experiences: list[ExcitedSegments], memory: float) -> None:
    """Doubt the estimates of a long time that those from well-excited flight contradict."""
    published = watch.references[-1]
    watch.disowned = np.zeros(len(full.coefficients), dtype=bool)
    for block, experience in enumerate(experiences):
        reference = estimates_of(experience, full, published.time - memory, published.time)
        if reference is not None:
            firm = (full.block == block) & (reference.uncertainty.freedom >= KNOWN)
            watch.disowned |= firm & (disagreement(reference, published) < DOUBT)
