"""The scores from which a diagnosis of the gap was decided, kept as JSON so that it can be decided again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor
from sysid_node.gap.selection.acceptance import ComparisonTable, is_accepted
from sysid_node.gap.selection.calibration import (
    CauseEvidence,
    calibrated_probability,
    is_supported_but_misspecified,
    probability_by_support,
)
from sysid_node.gap.selection.causes import Cause
from sysid_node.gap.selection.comparison import Comparison
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.selection.replacement import AlternativeTable, PositionTable, next_step
from sysid_node.gap.selection.retention import CauseTable, next_challenge
from sysid_node.gap.thresholds import Thresholds
from sysid_node.gap.verdict.decision import RejectedCauseScores, VerdictScores, decide


@dataclass(frozen=True)
class CandidateScores:
    """A candidate added to another explanation, and its lead over the final one (nats; 0 in the first stage)."""

    label: str
    comparison: ComparisonTable
    lead: float = 0.0


@dataclass(frozen=True)
class WeighedCause:
    """A cause that was kept, or an effect that is rejected."""

    label: str
    kept: bool
    share: float
    alternative_share: float
    evidence: CauseEvidence
    comparison: ComparisonTable | None  # of the final explanation against the one without it, where it was kept
    score_without: float
    alternatives: tuple[CandidateScores, ...]


@dataclass(frozen=True)
class RecordedDiagnosis:
    """All scores of one diagnosis."""

    name: str
    scores: VerdictScores
    causes: tuple[WeighedCause, ...]
    first_stage: tuple[CandidateScores, ...]

    def verdict(self, thresholds: Thresholds) -> str:
        """The verdict of the same causes by other thresholds."""
        known = {cause.label: cause.evidence for cause in self.causes if not cause.kept}
        rejected = tuple(_rejected(each, known[each.label], thresholds) for each in self.scores.rejected)
        return decide(replace(self.scores, rejected=rejected), thresholds).verdict

    def selection(self, thresholds: Thresholds) -> tuple[Any, ...]:
        """What the search for causes decides by these scores: where it changes, other fits would be asked for."""
        kept = [cause for cause in self.causes if cause.kept]
        tables = [
            CauseTable(
                c.label,
                c.share,
                c.alternative_share,
                calibrated_probability(c.evidence, thresholds),
                probability_by_support(c.evidence, thresholds),
            )
            for c in kept
        ]
        positions = [
            PositionTable(c.comparison, c.score_without,
                          tuple(AlternativeTable(a.label, a.comparison, a.lead) for a in c.alternatives))
            for c in kept if c.comparison is not None
        ]  # fmt: skip
        barred = frozenset(cause.label for cause in self.causes if not cause.kept)
        return (
            tuple(is_accepted(each.comparison, thresholds) for each in self.first_stage),
            next_step(positions, barred, thresholds),
            next_challenge(tables, thresholds=thresholds),
            tuple(calibrated_probability(c.evidence, thresholds) >= thresholds.calibration.probability
                  for c in self.causes if not c.kept),
        )  # fmt: skip


def _rejected(scores: RejectedCauseScores, evidence: CauseEvidence, thresholds: Thresholds) -> RejectedCauseScores:
    return replace(scores, supported_but_misspecified=is_supported_but_misspecified(evidence, thresholds))


def recorded(name: str, found: Diagnosis) -> RecordedDiagnosis:
    """The scores of a diagnosis."""
    attribution = found.attribution
    base, chosen = attribution.base, attribution.chosen
    weighed = [(cause, True) for cause in attribution.causes] + [(cause, False) for cause in attribution.rejected]
    return RecordedDiagnosis(
        name=name,
        scores=found.scores,
        causes=tuple(_weighed(base, chosen, cause, kept=kept) for cause, kept in weighed),
        first_stage=_candidates(base, base, attribution.first_stage, None),
    )


def _weighed(base: FittedSet, chosen: FittedSet, cause: Cause, *, kept: bool) -> WeighedCause:
    table = cause.table
    return WeighedCause(
        label=cause.candidate.label,
        kept=kept,
        share=cause.share,
        alternative_share=table.alternative_share,
        evidence=cause.evidence,
        comparison=Comparison(base, cause.without, chosen).table() if kept else None,
        score_without=cause.without.evidence.total,
        alternatives=_candidates(base, cause.without, cause.alternative_sets, chosen) if kept else (),
    )


def _candidates(
    base: FittedSet, without: FittedSet, fitted: Sequence[FittedSet], chosen: FittedSet | None
) -> tuple[CandidateScores, ...]:
    """Scores of fitted sets against one without what was added; those of which no numbers come are left out."""
    rows = []
    for each in fitted:
        try:
            comparison, lead = Comparison(base, without, each).table(), 0.0
            if chosen is not None:
                lead = each.evidence.total - chosen.evidence.total + log_bayes_factor(each.fit, chosen.fit)
        except np.linalg.LinAlgError:
            continue
        rows.append(CandidateScores(each.added.label if each.added else "", comparison, lead))
    return tuple(rows)


def write(path: Path, diagnoses: Sequence[RecordedDiagnosis]) -> None:
    """Writes recorded diagnoses as JSON."""
    path.write_text(json.dumps([_encoded(each) for each in diagnoses]), encoding="utf-8")


def read(path: Path) -> list[RecordedDiagnosis]:
    """The recorded diagnoses of a file."""
    return [_decoded(RecordedDiagnosis, each) for each in json.loads(path.read_text(encoding="utf-8"))]


def _encoded(value: Any) -> Any:
    if is_dataclass(value):
        return {entry.name: _encoded(getattr(value, entry.name)) for entry in fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_encoded(each) for each in value] if isinstance(value, tuple) else value


def _decoded(kind: Any, value: Any) -> Any:
    """A JSON value as a dataclass, tuple, array or plain value of a kind."""
    if is_dataclass(kind):
        kinds = get_type_hints(kind)
        return kind(**{name: _decoded(kinds[name], each) for name, each in value.items()})  # type: ignore[operator]
    choices = [each for each in get_args(kind) if each is not NoneType]
    if get_origin(kind) is tuple:
        return tuple(_decoded(choices[0], each) for each in value)
    if get_origin(kind) is np.ndarray:
        return np.array(value)
    return _decoded(choices[0], value) if choices and value is not None else value
