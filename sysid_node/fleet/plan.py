"""What is to be done: which flights of a catalogue are finished, which are not, and which cannot be begun."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.fleet.catalogue import locations
from sysid_node.fleet.catalogue.catalogue import Catalogue, CatalogueFlight
from sysid_node.fleet.outcome import FleetSettings, FlightTask
from sysid_node.fleet.state.fingerprints import fingerprint, known_hash
from sysid_node.fleet.state.store import FleetState


@dataclass(frozen=True)
class PlannedFlight:
    """A flight of the catalogue: with a ``fault`` in the entry, or its ``task`` and fingerprint; whether it is done."""

    entry: CatalogueFlight
    task: FlightTask | None
    fingerprint: str
    done: bool


class Plan:
    """The flights of a catalogue as they stand beside a state file, or beside none."""

    def __init__(
        self, catalogue: Catalogue, settings: FleetSettings, state: FleetState | None, cache: str = ""
    ) -> None:
        self.settings, self.cache, self._state = settings, cache, state
        self._aircraft = _AircraftFiles()
        self._log_faults: dict[str, str] = {}  # by flight, as its log was looked at last
        self.catalogue = replace(catalogue, flights=tuple(map(self._with_aircraft_fault, catalogue.flights)))

    def type_files(self) -> dict[str, Aircraft]:
        """The aircraft of each type by its name; of several files of one name the first.

        Derivatives that these files do not state alike are left out, so that nothing is compared with them.
        """
        found: dict[str, Aircraft] = {}
        for aircraft in filter(None, map(self.aircraft_of, self.catalogue.flights)):
            first = found.setdefault(aircraft.name, aircraft)
            if aircraft.derivatives != first.derivatives:
                alike = {k: d for k, d in first.derivatives.items() if aircraft.derivatives.get(k) == d}
                found[aircraft.name] = replace(first, derivatives=alike)
        return found

    def aircraft_of(self, entry: CatalogueFlight) -> Aircraft | None:
        """The aircraft of a flight; None where its file has a fault."""
        return self._aircraft.loaded(entry.aircraft)[0] if entry.aircraft else None

    def type_of(self, file: str) -> str:
        """The name in an aircraft file, or of a shipped one; what is given where it has a fault."""
        aircraft = self._aircraft.loaded(file)[0] if file else None
        return aircraft.name if aircraft is not None else file

    def _with_aircraft_fault(self, entry: CatalogueFlight) -> CatalogueFlight:
        if entry.fault or not entry.aircraft:
            return entry
        return replace(entry, fault=self._aircraft.loaded(entry.aircraft)[2] or self._aircraft.contradiction(entry))

    def fault_of(self, entry: CatalogueFlight) -> str:
        """What is wrong with a flight, one line: with its entry, or with its log where ``flights`` came to it."""
        return entry.fault or self._log_faults.get(entry.flight, "")

    def flights(self) -> Iterator[PlannedFlight]:
        """Every flight, one at a time; logs are hashed as they come.

        A log that an earlier flight of the same type has, too, under whatever name, is a fault: it would count twice.
        """
        finished = self._state.fingerprints() if self._state is not None else {}
        first: dict[tuple[str, str], str] = {}  # flight by type and log
        for entry in self.catalogue.flights:
            yield self._planned(entry, finished, first)

    def _planned(
        self, entry: CatalogueFlight, finished: dict[str, str], first: dict[tuple[str, str], str]
    ) -> PlannedFlight:
        if entry.fault:
            return PlannedFlight(entry, None, "", done=False)
        aircraft, text, _ = self._aircraft.loaded(entry.aircraft)
        assert aircraft is not None
        try:
            log = self._hash(entry.location)
            earlier = first.setdefault((aircraft.name, log), entry.flight)
            if earlier != entry.flight:
                raise InputError(f"{entry.flight}: is the same log as {earlier}, and would count twice; keep one")
        except InputError as error:
            self._log_faults[entry.flight] = str(error)
            return PlannedFlight(replace(entry, fault=str(error)), None, "", done=False)
        key = fingerprint(log, text, self.settings.as_dict())
        task = FlightTask(entry.flight, entry.location, aircraft, self.settings, self.cache)
        return PlannedFlight(entry, task, key, done=finished.get(entry.flight) == key)

    def _hash(self, location: str) -> str:
        if locations.is_remote(location):
            return locations.remote_hash(location)
        path = Path(location)
        if self._state is None:
            return known_hash(path, lambda *_: None, lambda *_: None)
        return known_hash(path, self._state.known_hash, self._state.remember_hash)


class _AircraftFiles:
    """Aircraft files, each read once: the aircraft, the file's text, and its fault."""

    def __init__(self) -> None:
        self._found: dict[str, tuple[Aircraft | None, str, str]] = {}
        self._first: dict[str, tuple[str, Aircraft]] = {}  # file and aircraft by type

    def loaded(self, name: str) -> tuple[Aircraft | None, str, str]:
        if name not in self._found:
            self._found[name] = self._load(name)
        return self._found[name]

    def contradiction(self, entry: CatalogueFlight) -> str:
        """What is wrong where an earlier file of the same type has another geometry; empty for nothing."""
        aircraft = self.loaded(entry.aircraft)[0]
        assert aircraft is not None
        file, first = self._first.setdefault(aircraft.name, (entry.aircraft, aircraft))
        if aircraft.geometry == first.geometry:
            return ""
        return (
            f"{entry.aircraft}: names its aircraft {aircraft.name!r} like {file}, but has another geometry, so that "
            "coefficients cannot be compared; give it another name, or the same geometry"
        )

    def _load(self, name: str) -> tuple[Aircraft | None, str, str]:
        try:
            aircraft = load_aircraft(name)
        except InputError as error:
            return None, "", str(error)
        return aircraft, repr(aircraft), ""
