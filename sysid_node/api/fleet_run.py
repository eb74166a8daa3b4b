"""A fleet from its catalogue to its results: what ``sysid fleet`` does."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

from sysid_node.aircraft.model import Aircraft
from sysid_node.api.fleet_flight import check_settings, estimate_flight
from sysid_node.errors import InputError, InputWarning
from sysid_node.fleet.assembly import assembled
from sysid_node.fleet.catalogue.catalogue import Catalogue
from sysid_node.fleet.catalogue.locations import is_remote
from sysid_node.fleet.engine.cluster import Workers, connected, local_workers
from sysid_node.fleet.engine.running import Limits
from sysid_node.fleet.fleet import FLIGHTS, work_through
from sysid_node.fleet.outcome import FleetSettings
from sysid_node.fleet.plan import Plan, PlannedFlight
from sysid_node.fleet.results import FleetResults
from sysid_node.fleet.state.store import FILES, STATE, FleetState
from sysid_node.fleet.statistics.summarise import summarise
from sysid_node.fleet.tables import document, write_tables
from sysid_node.report import fleet as fleet_report
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.report.results.fleet_report import FleetReport

SUMMARY = "fleet.json"

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class WorkersWanted:
    """``scheduler``: the address of one that runs; else ``count`` workers are started here, of ``memory`` each."""

    count: int = 1
    scheduler: str = ""
    memory: str | None = None

    def opened(self) -> AbstractContextManager[Workers]:
        """The workers, while the context lasts. Raises InputError."""
        return connected(self.scheduler) if self.scheduler else local_workers(self.count, self.memory)


def run_fleet(
    catalogue: Catalogue,
    out: str | Path,
    settings: FleetSettings,
    workers: WorkersWanted,
    *,
    limits: Limits | None = None,
    cache: str | Path | None = None,
    force: bool = False,
    inputs: Iterable[str | Path] = (),
    say: Callable[[str], None] = lambda text: None,
    progress: Progress = lambda share, doing: None,
) -> FleetReport:
    """Do what is missing or changed of a fleet; write its page, tables, tails' files and ``fleet.json`` into ``out``.

    ``inputs``: paths that ``out`` must not hold. ``say`` is called with the address of the workers' dashboard, and
    ``progress`` with the share done (0..1) and the flight that came back last. Raises InputError where settings are
    wrong, another run uses the folder, it cannot be written, or no worker is found. Warns (InputWarning) of aircraft
    files of one type that differ, and of maintenance of tails that are not there.
    """
    check_settings(settings)
    out = Path(out)
    logs = [flight.location for flight in catalogue.flights if not is_remote(flight.location)]
    with output_folder(out, "fleet", inputs=[*inputs, *logs], force=force, working=[*FILES, FLIGHTS]) as folder:
        state = FleetState(out / STATE)
        try:
            plan = Plan(catalogue, settings, state, str(Path(cache or default_cache()).absolute()))
            total = len(catalogue.flights)

            def tell(done: int, flight: str) -> None:
                progress(done / total, f"{done} of {total}, {flight}")

            if any(flight.task is not None and not flight.done for flight in plan.flights()):
                with workers.opened() as opened:
                    say(opened.client.dashboard_link)
                    work_through(plan, state, out, opened, estimate_flight, limits, tell)
            found = _report(plan, state, catalogue)
            folder.publish(lambda place: write_results(place, found, settings))
        finally:
            state.close()
    return found


def _report(plan: Plan, state: FleetState, catalogue: Catalogue) -> FleetReport:
    """What all flights that are done tell together."""
    results, files = assembled(plan, state), plan.type_files()
    of_flights = {flight.flight: plan.aircraft_of(flight) for flight in catalogue.flights}
    of_tails = {(flight.aircraft, flight.tail): of_flights[flight.flight] for flight in results.flights}  # the last
    known = {key: aircraft for key, aircraft in of_tails.items() if aircraft is not None}
    _warn_of_files(files, known)
    _warn_of_notes(results)
    return FleetReport(results, summarise(results, files), files, known)


def _warn_of_files(files: Mapping[str, Aircraft], of_tails: Mapping[tuple[str, str], Aircraft]) -> None:
    """Warn (InputWarning) where a type's files state different derivatives."""
    for name, aircraft in files.items():
        stated = {each for (kind, _), tail in of_tails.items() if kind == name for each in tail.derivatives}
        if left := sorted(stated - set(aircraft.derivatives)):
            text = f"the files of type {name} do not state {', '.join(left)} alike: not compared with the flights"
            warnings.warn(text, InputWarning, stacklevel=3)


def _warn_of_notes(results: FleetResults) -> None:
    """Warn (InputWarning) of maintenance of a tail that no flight with a result has."""
    tails = {(flight.aircraft, flight.tail) for flight in results.flights}
    for note in results.maintenance:
        if not any(note.concerns(*tail) for tail in tails):
            text = f"maintenance of {note.tail} on {note.date:%Y-%m-%d} ({note.text}): no flight of such a tail has a"
            warnings.warn(f"{text} result; is the tail's name right?", InputWarning, stacklevel=3)


@contextmanager
def planned(catalogue: Catalogue, out: str | Path, settings: FleetSettings) -> Iterator[Iterator[PlannedFlight]]:
    """What ``run_fleet`` would do, flight by flight, beside what the folder ``out`` holds; nothing is written."""
    check_settings(settings)
    path = Path(out) / STATE
    state = FleetState(path, read_only=True) if path.is_file() else None
    try:
        yield Plan(catalogue, settings, state).flights()
    finally:
        if state is not None:
            state.close()


def write_results(folder: Path, found: FleetReport, settings: FleetSettings) -> None:
    """Write the page, the tables, the tails' aircraft files and ``fleet.json``. Raises OSError, InputError."""
    write_tables(folder, found.results)
    fleet_report.write(found.results, found.summary, folder, found.files, found.tail_files)
    content = {**document(found.results, settings.as_dict()), "summary": found.summary.to_json()}
    text = json.dumps(content, indent=2, ensure_ascii=False, default=str)
    (folder / SUMMARY).write_text(text + "\n", encoding="utf-8")


def default_cache() -> Path:
    """The folder for copies of remote logs: ``$XDG_CACHE_HOME/sysid/logs``, by default under ``~/.cache``."""
    root = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(root) if root else Path.home() / ".cache") / "sysid" / "logs"


def require_results(results: FleetResults) -> None:
    """Raise InputError where not one flight gave a result."""
    if not results.flights:
        first = results.refusals[0].reason if results.refusals else "it has no flights"
        raise InputError(f"no flight of the catalogue gave a result; the first: {first}")
