"""Forward selection of effects, and the explanation that follows.

Candidates are added one at a time, up to three, each where it is accepted (``acceptance``). Then every cause is
compared with its alternatives (``alternatives``), and those that are improbable are dropped or replaced (``causes``).
Where some were, the selection goes on from those that are left, as stepwise regression does (Efroymson (1960), in
Ralston & Wilf, Mathematical Methods for Digital Computers): beside a wrong cause the right one may not have been seen,
and what was not needed beside a cause may be needed beside what took its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised, unfitted
from sysid_node.gap.estimation.candidates import RESPONSE_DELAYS, SHARED, Candidate, candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import HeldOutFlight, Nuisances
from sysid_node.gap.estimation.predictive_density import probabilities
from sysid_node.gap.estimation.restriction import (
    beside_file_derivatives,
    has_insignificant_cause,
    insignificant_sizes,
    restricted,
)
from sysid_node.gap.instruments.liml import liml_estimate
from sysid_node.gap.instruments.overidentification import (
    OveridentificationTest,
    overidentification_of,
    pooled_overidentification,
)
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.selection.acceptance import (
    is_accepted,
    is_favoured_by_derivatives,
    nats_by_tolerances,
    predicts_better,
)
from sysid_node.gap.selection.candidate_fitter import CandidateFitter, Progress, in_parallel
from sysid_node.gap.selection.causes import Cause, Selection, select_causes
from sysid_node.gap.selection.comparison import Comparison, derivative_shift
from sysid_node.gap.selection.fitted_set import FittedSet, Stage
from sysid_node.gap.selection.retention import kept_causes
from sysid_node.gap.selection.screening import best_screened, with_found_starts
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import EFFECTS


@dataclass(frozen=True)
class Attribution:
    """An explanation of flights: its causes, what it was built on, and what it leaves."""

    base: FittedSet  # nuisances only
    chosen: FittedSet  # the causes' candidates
    corrected: CandidateFit  # of ``chosen``, free of the bias that gusts cause
    structure_before: OveridentificationTest  # of what the nuisances leave
    structure_left: OveridentificationTest  # of what the causes leave
    causes: tuple[Cause, ...]
    rejected: tuple[Cause, ...]  # what predicts better, but is improbable; ``doubted`` in gap.json
    ranking: tuple[tuple[str, float], ...]  # candidates fitted alone, and their probabilities, the best first
    first_stage: tuple[FittedSet, ...] = ()  # these candidates, fitted
    held_out: tuple[HeldOutFlight, ...] = ()
    size_source: CandidateFit | None = None  # of the sizes, where the corrected fit has the file's derivatives
    sizes_of_file: bool = False  # whether these belong to the file's derivatives, not to the fitted ones
    held: tuple[int, ...] = ()  # entries of causes' sizes that were held at the aircraft file's values

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels of its causes."""
        return tuple(cause.candidate.label for cause in self.causes)

    @property
    def keeps_file_derivatives(self) -> bool:
        """Whether the derivatives are the file's, with causes beside them."""
        return self.size_source is not None

    @property
    def size_fit(self) -> CandidateFit:
        """The fit that the sizes of causes and their standard errors are from."""
        return self.size_source or self.corrected

    @property
    def is_favoured_by_derivatives(self) -> bool:
        """Whether the derivatives are plausible together beside the causes, and much less so without them."""
        return is_favoured_by_derivatives(
            (derivative_shift(self.base.fit), derivative_shift(self.chosen.fit)), len(EFFECTS)
        )

    def has_less_plausible_derivatives_than(self, larger: Attribution) -> bool:
        """Whether the derivatives together are less plausible than beside the causes of a larger explanation.

        They are not where they are implausible beside these, too.
        """
        return nats_by_tolerances((derivative_shift(self.chosen.fit), derivative_shift(larger.chosen.fit))) > 0.0

    def as_in_file(self) -> Attribution:
        """The same with the aircraft file as the corrected fit: where fitted derivatives predict worse."""
        neutral = [model.simulator.neutral() for model in self.base.fit.models]
        return replace(self, corrected=linearised(self.base.fit.at(neutral)))

    def with_file_derivatives(self, *, sizes: bool) -> Attribution:
        """The same causes with the file's own derivatives; and the ``sizes`` that belong to these, or the fit's.

        The sizes' standard errors are those beside the fitted derivatives, of which it was not known that they are the
        file's.
        """
        fit, neutral = self.corrected, self.corrected.simulator.neutral()
        if sizes:
            fit = beside_file_derivatives(fit, self.held)
        entries, points = [*fit.indices, *fit.widened], [neutral.copy() for _ in fit.flights]
        for point, flight in zip(points, fit.flights, strict=True):
            point[entries] = flight.point[entries]
        moved = replace(linearised(fit.at(points)), information=fit.information)
        source = self.corrected.at([flight.point for flight in fit.flights])
        return replace(self, corrected=moved, size_source=source, sizes_of_file=sizes)

    def by_least_squares(self) -> Attribution:
        """The same causes with the sizes of least squares."""
        return replace(self, corrected=self.chosen.fit, size_source=None)

    def without_insignificant_sizes(self, errors: Callable[[CandidateFit], Array]) -> Attribution | None:
        """The same causes with insignificant sizes at the file's values; none where all are significant.

        ``errors`` returns the standard errors (unknowns,) of a fit as they are stated.
        """
        held = insignificant_sizes(self.size_fit, errors(self.size_fit)[: len(self.size_fit.indices)])
        if not held:
            return None
        moved = replace(self, corrected=restricted(self.size_fit, held), size_source=None, held=held)
        return moved.with_file_derivatives(sizes=self.sizes_of_file) if self.keeps_file_derivatives else moved

    def has_insignificant_cause(self, errors: Callable[[CandidateFit], Array]) -> bool:
        """Whether no size of some cause is significant; ``errors`` as in ``without_insignificant_sizes``."""
        return has_insignificant_cause(self.size_fit, errors(self.size_fit)[: len(self.size_fit.indices)])

    def with_fewer_causes(self) -> Iterator[Attribution]:
        """The explanations with one cause less, and of three those with one alone, in the order of ``kept_causes``."""
        alone = {each.added.label: each for each in self.first_stage if each.added}
        for kept in kept_causes([cause.probability for cause in self.causes]):
            causes = tuple(self.causes[i] for i in kept)
            left_out = [cause for i, cause in enumerate(self.causes) if i not in kept]
            chosen = left_out[0].without if len(left_out) == 1 else alone.get(causes[0].candidate.label)
            if chosen is not None:
                yield self._explained_by(chosen, causes)

    def without_causes(self) -> Attribution:
        """The derivatives within their tolerances alone."""
        return self._explained_by(self.base, ())

    def _explained_by(self, chosen: FittedSet, causes: tuple[Cause, ...]) -> Attribution:
        """The same with fewer causes."""
        left = pooled_overidentification(chosen.fit, self.held_out)
        corrected = liml_estimate(chosen.fit)
        return replace(
            self, chosen=chosen, corrected=corrected, size_source=None, held=(), structure_left=left, causes=causes
        )


def attribute(
    models: Sequence[ResidualModel],
    nuisances: Nuisances,
    progress: Progress,
    checkpoint: Checkpoint | None = None,
    held_out: Sequence[HeldOutFlight] = (),
) -> Attribution:
    """The explanation of flights. Nothing is fitted to flights held out, but explanations must predict them, too."""
    fitter = CandidateFitter(nuisances, checkpoint or Checkpoint(), held_out)
    candidates = candidates_of(models[0].simulator, models)
    progress(0.0, "derivatives within their tolerances")
    base = fitter.fit_set(unfitted(models, nuisances), [])
    chosen, stages = _forward(fitter, base, base, candidates, progress)
    progress(0.8, "whether another effect would do as well")
    variants = {each.effect for each in chosen.fit.candidates if each.effect in SHARED}
    always = [each for each in candidates if each.effect in RESPONSE_DELAYS | variants]
    selection = select_causes(fitter, base, chosen, stages, always)
    progress(0.9, "what else there is in place of causes that were dropped")
    kept, causes, rejected = selection
    if causes and (rejected or len(kept.fit.candidates) < len(chosen.fit.candidates)):
        selection = _selected_again(fitter, base, selection, stages, candidates, always)
    chosen, causes, rejected = selection
    return Attribution(
        base=base,
        chosen=chosen,
        corrected=liml_estimate(chosen.fit),
        structure_before=overidentification_of(base.fit, chosen.fit.powers),
        structure_left=pooled_overidentification(chosen.fit, held_out),
        causes=causes,
        rejected=rejected,
        ranking=_ranking(base, stages[0].fitted),
        first_stage=tuple(stages[0].fitted),
        held_out=tuple(held_out),
    )


def _selected_again(
    fitter: CandidateFitter,
    base: FittedSet,
    first: Selection,
    stages: Sequence[Stage],
    candidates: Sequence[Candidate],
    always: Sequence[Candidate],
) -> Selection:
    """A selection after the search went on from the causes that were kept; the first one where that predicts no better.

    Doubted causes are left out. Without any cause that is kept, every candidate has been tried alone. Where none was
    rejected, only what has been fitted beside the causes that were kept is tried again, which costs little.
    """
    chosen, _, rejected = first
    if rejected:
        left_out = {cause.candidate.label for cause in rejected}
        rest = [each for each in candidates if each.label not in left_out]
    else:
        kept = frozenset(each.label for each in chosen.fit.candidates)
        rest = [each for each in candidates if kept | {each.label} in fitter.fitted]
    larger, more = _forward(fitter, base, chosen, rest, lambda share, text: None)
    if larger is chosen:
        return first
    again = select_causes(fitter, base, larger, [*stages, *more], always, rejected)
    return again if predicts_better(Comparison(base, chosen, again[0]).probability) else first


def _forward(
    fitter: CandidateFitter, base: FittedSet, start: FittedSet, candidates: Sequence[Candidate], progress: Progress
) -> tuple[FittedSet, list[Stage]]:
    """The explanation that forward selection from ``start`` ends with, and its stages.

    In each stage candidates are added to the best explanations of the stage before, of which the best need not be part
    of the best larger one. It goes on as long as a candidate is accepted, and the larger explanation may also take the
    best smaller one's place: what mends a poor explanation need not be worth another cause. What one step brings no
    further than the best explanation so far is not fitted.
    """
    best, frontier, stages = start, [start], list[Stage]()
    begun = len(start.fit.candidates)
    for count, (width, most) in enumerate(THRESHOLDS.search.stages[begun:]):
        pairs = fitter.screen_upon(frontier[:width], candidates, _share_of(progress, count))
        likely = best_screened(pairs, most)
        promising = [pair for pair in likely if pair.screened.deviance < best.deviance]
        fitted = fitter.fit_screened(promising, _share_of(progress, count))
        candidates = with_found_starts(candidates, [pair.screened for pair in pairs])
        stages.append(Stage([larger for _, larger in fitted], [pair.screened.candidate for pair in likely]))
        accepted = in_parallel(partial(is_better, base, best), fitted, lambda share: None)
        better = [larger for (_, larger), stands in zip(fitted, accepted, strict=True) if stands]
        if not better:
            break
        best, frontier = better[0], better
    return best, stages


def is_better(base: FittedSet, best: FittedSet, pair: tuple[FittedSet, FittedSet]) -> bool:
    """Whether the larger of two explanations is accepted beside the smaller, and in place of the best so far.

    Where it holds the best so far and one candidate more, that one counts, whichever of them was added first.
    """
    smaller, larger = pair
    rest = [each for each in larger.fit.candidates if each not in best.fit.candidates]
    if len(rest) == len(larger.fit.candidates) - len(best.fit.candidates) == 1:
        return is_accepted(Comparison(base, best, replace(larger, added=rest[0])))
    return _takes_the_place(base, best, larger) and is_accepted(Comparison(base, smaller, larger))


def _takes_the_place(base: FittedSet, best: FittedSet, larger: FittedSet) -> bool:
    """Whether an explanation with a cause more is accepted in place of the best so far.

    One with no more parameters need only predict better beyond doubt: a lag and a delay are two causes, but no more
    than one lag of second order.
    """
    comparison = Comparison(base, best, larger)
    sizes = (sum(len(each.entries) for each in explanation.fit.candidates) for explanation in (larger, best))
    return is_accepted(comparison) or (next(sizes) <= next(sizes) and predicts_better(comparison.probability))


def _share_of(progress: Progress, count: int) -> Progress:
    """Progress of one of the stages as that of all."""
    return lambda share, text: progress((count + share) / (len(THRESHOLDS.search.stages) + 1.0), text)


def _ranking(base: FittedSet, fitted: Sequence[FittedSet]) -> tuple[tuple[str, float], ...]:
    """Every effect that was fitted alone, and "none", each with its probability by prediction; the best first."""
    shares = probabilities([*(each.evidence.scores for each in fitted), base.evidence.scores])
    labels = [*(each.added.label for each in fitted if each.added), "none"]
    return tuple(sorted(zip(labels, shares.tolist(), strict=True), key=lambda pair: -pair[1]))
