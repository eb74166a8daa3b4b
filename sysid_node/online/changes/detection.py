"""Abrupt changes of the aircraft, and flight that the estimates do not explain.

The transforms of the last seconds are kept in pieces. Each time a piece is complete, stretches of 1.5 s and more that
end in it are tested against the estimates from before them (``score_test``): the generalised likelihood ratio over
the time of change (Basseville & Nikiforov, "Detection of Abrupt Changes", 1993, sec. 7.2).

Two levels of significance apply. Estimates that the last seconds contradict at the level ``SIGNIFICANCE`` are invalid.
At the level ``FALSE_ALARM`` the estimator forgets all data from before the time of change. It reports a change of the
aircraft if the last seconds contradict earlier manoeuvres at that level, too (``excited_segments``); otherwise the
earlier estimates were biased. Where no derivatives explain the residuals, the model itself does not hold, for example
near the stall.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from sysid_node.online.changes.excited_segments import ExcitedSegments, estimates_of
from sysid_node.online.changes.score_test import ReferenceEstimates, ScoreTest, disagreement, score_test
from sysid_node.online.regression.information import Spectrum, clean_lines
from sysid_node.online.regression.instruments import InstrumentModel
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic.corrected_lines import CorrectedLines

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

PIECE = 0.5  # s
SPANS = (3, 6, 12, 24)  # pieces looked back over
LONG = 12  # pieces from which on a stretch's lines can be corrected: both ends take a line, of the few of a short one
EVERY = 3  # a span of n times so many pieces is looked at with every n-th piece
FALSE_ALARM = 1e-9  # a test: an hour has 7200 pieces, times six coefficients and about two spans
MARGIN = 1.5  # and F must exceed what chance allows by this factor: no model is exact
#: Level of significance at which a test makes an estimate invalid. The tests of a coefficient, of the spans and by
#: well-excited flight, share one in a hundred (Bonferroni), so that all of them together do so by chance no more often.
SIGNIFICANCE = 1e-2 / (len(SPANS) + 1)
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
    references: deque[ReferenceEstimates] = field(default_factory=lambda: deque(maxlen=SPANS[-1] + 1))
    typical_statistic: deque[Array] = field(
        default_factory=lambda: deque(maxlen=SPANS[-1] + 1)
    )  # (C,) F where nothing changes
    contradicted: dict[int, Flags] = field(default_factory=dict)  # (C,) by span
    outside_model: Flags | None = None  # (C,)
    contradicted_by_excited: Flags | None = None  # (C,) by what was learned in well-excited flight
    examinations: int = 0

    def before_examination(self) -> ChangeMonitor:
        """The same with what the next examination finds left out; pieces and references are shared."""
        typical = deque(self.typical_statistic, maxlen=self.typical_statistic.maxlen)
        return replace(self, typical_statistic=typical, contradicted=dict(self.contradicted))

    def add_reference(self, reference: ReferenceEstimates) -> None:
        """Add the present estimates, in place of those that were made of the same flight before."""
        if self.references and self.references[-1].time == reference.time:
            self.references.pop()
        self.references.append(reference)

    def standing(self, C: int) -> ChangeDecision:
        """What was found of each of ``C`` coefficients when a span was last looked at."""
        none = np.zeros(C, dtype=bool)
        by_excited = none if self.contradicted_by_excited is None else self.contradicted_by_excited
        contradicted = np.any([by_excited, *self.contradicted.values()], axis=0)
        return ChangeDecision(contradicted, none if self.outside_model is None else self.outside_model)


@dataclass(frozen=True)
class ChangeDecision:
    """What the last seconds say of each coefficient (C,), and since when (s) all must be learned anew, if it must."""

    contradicted: Flags
    outside_model: Flags
    since: float | None = None
    changed: bool = False  # whether it is the aircraft that has changed


@dataclass(frozen=True)
class ChangeTests:
    """The data and settings that all tests at one time share."""

    full: NormalEquations
    model: InstrumentModel | None
    spectrum: Spectrum
    change_monitor: ChangeMonitor
    now: float
    memory: float  # s, inf = nothing is forgotten

    def lines(self, span: int) -> tuple[float, Array]:
        """Start (s) and clean lines of the last ``span`` pieces."""
        return self.change_monitor.pieces[-span][0], clean_lines(_summed(self.change_monitor.pieces, span), self.model)

    def contradictions(self, spans: Iterable[int]) -> Iterator[tuple[int, ScoreTest]]:
        """How the last pieces contradict the estimates from before them: of the ``spans`` (rising) that have such."""
        known = list(_stretches(self.change_monitor, self.change_monitor.pieces, self.now, spans))
        return zip(spans, _tested(known, self.spectrum), strict=False)


class _Stretch(NamedTuple):
    """One or several pieces in a row, and the estimates from before them."""

    start: float  # s
    end: float
    part: Array  # (2F + 1, W) transform
    before: ReferenceEstimates

    @property
    def kind(self) -> tuple[int, int, bool]:
        """What stretches have in common that are tested at once: equations, servos, whether lines are corrected."""
        return id(self.before.equations), id(self.before.model), self.before.correction is not None

    def corrected(self, spectrum: Spectrum) -> CorrectedLines:
        """Clean lines, corrected as those are that the estimates are of."""
        known = self.before
        assert known.correction is not None
        return known.correction.correct(
            self.part, known.model, spectrum.omega, (self.start, self.end), known.equations, known.solution.theta
        )


def _summed(pieces: Sequence[tuple[float, Array]], span: int) -> Array:
    """(2F + 1, W) transform of the last ``span`` pieces."""
    return np.asarray(sum(piece for _, piece in islice(pieces, len(pieces) - span, None)))


def _stretches(
    change_monitor: ChangeMonitor, pieces: Sequence[tuple[float, Array]], end: float, spans: Iterable[int]
) -> Iterator[_Stretch]:
    """The last of the ``pieces``, up to ``end`` (s): of the ``spans`` up to the first without estimates before it."""
    for span in spans:
        start = pieces[-span][0] if span <= len(pieces) else -math.inf
        reference = next((r for r in reversed(change_monitor.references) if r.time <= start + 1e-6), None)
        if reference is None:
            return
        known = reference.corrected if span >= LONG and reference.corrected is not None else reference
        yield _Stretch(start, end, _summed(pieces, span), known)


def _tested(stretches: Sequence[_Stretch], spectrum: Spectrum) -> Iterator[ScoreTest]:
    """How each contradicts the estimates from before it; those by the same equations at once.

    The controls are where the servos had them with which the estimates were made. They may be others by now.
    """
    for (*_, corrected), some in groupby(stretches, key=lambda stretch: stretch.kind):
        stretched = list(some)
        duration = np.array([stretch.end - stretch.start for stretch in stretched])
        reference = ReferenceEstimates.stacked([stretch.before for stretch in stretched])
        if corrected:
            lines, errors = map(np.array, zip(*(one.corrected(spectrum) for one in stretched), strict=True))
        else:
            lines, errors = clean_lines(np.array([stretch.part for stretch in stretched]), reference.model), None
        yield from score_test(reference, lines, spectrum, duration, errors).each()


def _due(look: int) -> list[int]:
    """The spans that are looked at with the look of this number."""
    return [span for span in SPANS if not look % max(span // EVERY, 1)]


def examine(tests: ChangeTests, excited_segments: list[ExcitedSegments]) -> ChangeDecision:
    """What the tests of the spans that are due say of each coefficient, and from when on all must be learned anew."""
    change_monitor, C = tests.change_monitor, len(tests.full.structure.coefficients)
    change_monitor.examinations += 1
    surest = 1.0
    for span, found in tests.contradictions(_due(change_monitor.examinations)):
        known = found.freedom >= KNOWN
        typical_statistic = _typical_statistic(change_monitor, span, C)
        change_monitor.contradicted[span] = known & (found.chance(typical_statistic) < SIGNIFICANCE)
        surest = min(surest, float(np.where(known, found.chance(MARGIN * typical_statistic), 1.0).min()))
        if span == USUAL:
            change_monitor.outside_model = known & (found.share > LOST) & (found.unexplained > NOISE_RATIO)
            _update_typical_statistic(change_monitor, found, C)
    standing = change_monitor.standing(C)
    if surest >= FALSE_ALARM:
        return standing
    span = _onset(tests)
    changed = any(_contradicted(tests, span, excited, block) for block, excited in enumerate(excited_segments))
    # the change fell somewhere in the oldest piece: what came after it is all new
    return replace(standing, since=change_monitor.pieces[1 - span][0], changed=changed)


def _typical_statistic(change_monitor: ChangeMonitor, span: int, C: int) -> Array:
    """(C,) the usual F before the last ``span`` pieces, at least 1."""
    return change_monitor.typical_statistic[-span] if span <= len(change_monitor.typical_statistic) else np.ones(C)


def _update_typical_statistic(change_monitor: ChangeMonitor, found: ScoreTest, C: int) -> None:
    """Update the typical F: where the model is inexact, F exceeds its distribution under the null hypothesis."""
    last = change_monitor.typical_statistic[-1] if change_monitor.typical_statistic else np.ones(C)
    change_monitor.typical_statistic.append(
        np.maximum(last + LEARNING * (np.minimum(found.statistic, OUTLIER) - last), 1.0)
    )


def _onset(tests: ChangeTests) -> int:
    """Pieces since the change: the shortest span that contradicts about as much as any."""
    every = tests.contradictions(range(SPANS[0], len(tests.change_monitor.pieces) + 1))
    quadratics = [float((found.statistic * found.count)[found.freedom >= KNOWN].max(initial=0.0)) for _, found in every]
    return SPANS[0] + int(np.argmax(np.array(quadratics) >= AS_MUCH * max(quadratics)))


def _contradicted(tests: ChangeTests, span: int, excited: ExcitedSegments, block: int) -> bool:
    """Whether the last ``span`` pieces contradict earlier manoeuvres that moved the controls as much."""
    start, lines = tests.lines(span)
    reference = estimates_of(excited, tests.full, tests.now - tests.memory, start)
    if reference is None or excited.exceeds_all((lines[:, excited.controls] ** 2).sum(axis=0)):
        return False
    # the servos' times are those of all flight so far, whichever segments the estimates are of
    reference = replace(reference, time_errors=tests.change_monitor.references[-1].time_errors)
    found = score_test(reference, lines, tests.spectrum, tests.now - start)
    tested = (tests.full.structure.block == block) & (found.freedom >= KNOWN)
    return bool((found.chance(MARGIN)[tested] < FALSE_ALARM).any())


def residuals_of_earlier_flight(tests: ChangeTests, excited_segments: list[ExcitedSegments], end: float) -> Array:
    """(2, C) degrees of freedom and sums of squares of the residuals, of well-excited flight until ``end`` (s)."""
    structure = tests.full.structure
    residuals = np.zeros((2, len(structure.coefficients)))
    for block, excited in enumerate(excited_segments):
        reference = estimates_of(excited, tests.full, tests.now - tests.memory, end)
        if reference is not None:
            found = np.array([reference.uncertainty.freedom, reference.solution.residual])
            residuals[:, structure.block == block] = found[:, structure.block == block]
    return residuals


def fits_worse(residuals: Array, before: Array, unknowns: int) -> bool:
    """Whether a model with other values of so many ``unknowns`` fits earlier flight worse than chance allows.

    ``residuals`` are those with the other values, ``before`` those with the former ones, both (2, C).

    The likelihood ratio of two models whose noise is estimated, too (Davison, "Statistical Models", 2003, sec. 4.5).
    """
    freedom, squares = residuals
    known = (freedom >= KNOWN) & (before[1] > 0.0)
    ratio = float((freedom[known] * np.log(squares[known] / before[1][known])).sum())
    return bool(chdtrc(unknowns, max(ratio / MARGIN, 0.0)) < SIGNIFICANCE)


def compare(
    full: NormalEquations, change_monitor: ChangeMonitor, excited_segments: list[ExcitedSegments], memory: float
) -> None:
    """Mark the coefficients whose estimates contradict those from well-excited flight.

    Estimates by least squares, where instruments are weak in that flight, are biased by gusts. They contradict none
    that are made by instruments.
    """
    published = change_monitor.references[-1]
    change_monitor.contradicted_by_excited = np.zeros(len(full.structure.coefficients), dtype=bool)
    for block, excited in enumerate(excited_segments):
        reference = estimates_of(excited, full, published.time - memory, published.time)
        if reference is not None:
            alike = reference.equations.instrumented | ~published.equations.instrumented
            firm = alike & (full.structure.block == block) & (reference.uncertainty.freedom >= KNOWN)
            change_monitor.contradicted_by_excited |= firm & (disagreement(reference, published) < SIGNIFICANCE)
