"""What the fleet's page and tables are written from: the flights' results and what they tell together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from sysid_node.aircraft.model import Aircraft
from sysid_node.fleet.results import FleetResults, MaintenanceNote
from sysid_node.fleet.statistics.drift import Drift
from sysid_node.fleet.statistics.population import Population
from sysid_node.fleet.statistics.summary import FleetSummary, TailDeviation


@dataclass(frozen=True)
class FleetReport:
    """Results, summary, and the aircraft files of the types where they are known.

    ``tail_files``: by type and tail the file of a tail's last flight, where it is not the type's.
    """

    results: FleetResults
    summary: FleetSummary
    files: Mapping[str, Aircraft] = field(default_factory=dict)
    tail_files: Mapping[tuple[str, str], Aircraft] = field(default_factory=dict)

    @cached_property
    def drifts(self) -> list[Drift]:
        """The significant drifts, by tail and then the surest first."""
        found = [drift for drift in self.summary.drifts.values() if drift.significant]
        return sorted(found, key=lambda d: (d.aircraft, d.tail, d.p_value))

    @cached_property
    def odd(self) -> list[TailDeviation]:
        """The tails and derivatives that stand out from their type, the surest first."""
        return sorted((d for d in self.summary.deviations.values() if d.significant), key=lambda d: d.adjusted_p)

    def populations(self, aircraft: str) -> list[Population]:
        """The populations of one type, in the order of its aircraft file's derivatives where that is known."""
        found = [p for p in self.summary.populations.values() if p.series.aircraft == aircraft]
        order = list(self.files[aircraft].derivatives) if aircraft in self.files else []
        return sorted(found, key=lambda p: order.index(p.series.name) if p.series.name in order else len(order))

    def maintenance(self, aircraft: str, tail: str) -> list[MaintenanceNote]:
        """The notes of one tail of a type, by date."""
        notes = (note for note in self.results.maintenance if note.concerns(aircraft, tail))
        return sorted(notes, key=lambda note: note.date)

    def tail_name(self, aircraft: str, tail: str) -> str:
        """A tail's name, with its type where another type has a tail of the same name."""
        return f"{tail} ({aircraft})" if self.summary.is_ambiguous(tail) else tail
