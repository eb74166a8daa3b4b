"""What the diagnoses of single flights say of each possible cause, from their gap.json."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sysid_node.fleet.results import FlightResult

#: Share of the flights that name a cause, from which an alternative to it counts as confused with it.
_CONFUSED = 0.2
_LARGEST, _SMALLEST = 0.999, 1e-3  # probability that one flight may give


@dataclass(frozen=True)
class FlightDiagnosis:
    """One flight's diagnosis: the probability of every cause that was weighed, by label.

    ``sizes`` are the value and standard error of each parameter of a cause that was kept or doubted. ``alternatives``
    are the labels that were weighed beside a named cause as doing the same. ``informative`` is False where the flight
    could not support a diagnosis.
    """

    flight: FlightResult
    verdict: str
    probabilities: Mapping[str, float]
    sizes: Mapping[str, Mapping[str, tuple[float, float]]]
    alternatives: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def informative(self) -> bool:
        """Whether an absent cause says anything."""
        return self.verdict != "unsupported"


def diagnoses_of(flights: Iterable[FlightResult]) -> list[FlightDiagnosis]:
    """The diagnoses of all flights that have one."""
    return [_diagnosis(flight, flight.gap) for flight in flights if flight.gap is not None]


def _diagnosis(flight: FlightResult, gap: Mapping[str, Any]) -> FlightDiagnosis:
    named = [*gap.get("causes", ()), *gap.get("doubted", ())]
    weighed = {c["effect"]: c["probability"] for c in gap.get("candidates", ()) if c.get("probability") is not None}
    weighed |= {c["label"]: c["probability"] for c in named}
    sizes = {
        c["label"]: {key: (float(v), float(e)) for key, (v, e) in c.get("parameters", {}).items() if _usable(v, e)}
        for c in named
    }
    own = {c["label"] for c in named}
    alternatives = {
        c["label"]: tuple(
            label for label in weighed if label not in own and label.partition(" of ")[0] in c["indistinguishable_from"]
        )
        for c in named
        if c.get("indistinguishable_from")
    }
    probabilities = {label: min(max(float(p), _SMALLEST), _LARGEST) for label, p in weighed.items()}
    return FlightDiagnosis(flight, str(gap.get("verdict", "")), probabilities, sizes, alternatives)


def _usable(value: object, error: object) -> bool:
    """Whether both are numbers and the error is positive."""
    numbers = isinstance(value, int | float) and isinstance(error, int | float)
    return numbers and math.isfinite(value) and math.isfinite(error) and error > 0  # type: ignore[arg-type, operator]


def confused_groups(diagnoses: Sequence[FlightDiagnosis]) -> list[tuple[str, ...]]:
    """Labels that some flight gives at least an even chance, in groups of those that flights confuse.

    Two labels are in one group where one is an alternative to the other in at least a fifth of the flights that name
    the other. Labels that are only alternatives belong to the group of what they are confused with.
    """
    named = Counter(label for d in diagnoses for label, p in d.probabilities.items() if p >= 0.5)
    pairs = Counter(
        (label, other)
        for d in diagnoses
        for label, others in d.alternatives.items()
        for other in others
        if label in named
    )
    group: dict[str, set[str]] = {label: {label} for label in named}
    for (label, other), count in pairs.items():
        if count >= _CONFUSED * named[label]:
            joined = group.get(label, {label}) | group.get(other, {other})
            for each in joined:
                group[each] = joined
    return sorted({tuple(sorted(labels)) for labels in group.values()})
