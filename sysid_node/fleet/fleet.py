"""Works through a fleet: hands out what is missing or changed, and keeps each result the moment it comes back."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from sysid_node.errors import InputError
from sysid_node.fleet.engine.cluster import Workers
from sysid_node.fleet.engine.guarded import Returned
from sysid_node.fleet.engine.running import Job, Limits, run
from sysid_node.fleet.outcome import FlightOutcome, FlightTask
from sysid_node.fleet.plan import Plan, PlannedFlight
from sysid_node.fleet.state.store import FleetState

#: The folder of the flights' own reports.
FLIGHTS = "flights"
_STAGE = ".unfinished"

Work = Callable[[FlightTask], FlightOutcome]


@dataclass
class Counts:
    """Of this start of the command: flights that were ``worked`` on, were done ``before``, or have a fault."""

    worked: int = 0
    before: int = 0
    faults: int = 0


def work_through(
    plan: Plan,
    state: FleetState,
    folder: Path,
    workers: Workers,
    work: Work,
    limits: Limits | None = None,
    progress: Callable[[int, str], None] = lambda done, flight: None,
) -> Counts:
    """Do what is missing or changed of a plan; each result is in the state file before the next is looked at.

    ``folder`` is the fleet's, in which ``flights`` holds the flights' own reports. ``progress`` is called with the
    number of flights that need no more work and the name of the last. Raises InputError where results cannot be
    written, and SchedulerLostError.
    """
    counts = Counts()
    shutil.rmtree(folder / FLIGHTS / _STAGE, ignore_errors=True)

    def tell(flight: str) -> None:
        progress(counts.worked + counts.before + counts.faults, flight)

    def jobs() -> Iterator[Job[PlannedFlight]]:
        for planned in plan.flights():
            if planned.task is not None and not planned.done:
                yield Job(planned.entry.flight, planned)
                continue
            counts.before += planned.done
            counts.faults += not planned.done
            tell(planned.entry.flight)

    def done(job: Job[PlannedFlight], returned: Returned[FlightOutcome]) -> None:
        _keep(state, folder, job.given, returned)
        counts.worked += 1
        tell(job.name)

    run(workers.client, jobs(), _OfTask(work), done, limits, workers.revive)
    return counts


@dataclass(frozen=True)
class _OfTask:
    """The work on a planned flight's task, which is all of the plan that a worker needs."""

    work: Work

    def __call__(self, planned: PlannedFlight) -> FlightOutcome:
        assert planned.task is not None
        return self.work(planned.task)


def _keep(state: FleetState, folder: Path, planned: PlannedFlight, returned: Returned[FlightOutcome]) -> None:
    """Write a flight's own report and then its row: a row never names a report that is not there."""
    entry, outcome = planned.entry, returned.result
    assert planned.task is not None
    if outcome is None:
        name = planned.task.aircraft.name
        took, lost = returned.seconds, returned.broken
        state.refuse(entry.flight, planned.fingerprint, returned.refusal, aircraft=name, lost=lost, took=took)
        return
    report = None
    if outcome.files:
        _write_files(folder / FLIGHTS, entry.folder, outcome)
        report = f"{FLIGHTS}/{entry.folder}/{outcome.report}" if outcome.report else None
    took, remarks = returned.seconds, returned.remarks
    state.keep(entry.flight, planned.fingerprint, outcome, report=report, remarks=remarks, took=took)


def _write_files(folder: Path, name: str, outcome: FlightOutcome) -> None:
    """Write a flight's files aside and move them into place. Raises InputError where they cannot be written."""
    stage = folder / _STAGE
    try:
        shutil.rmtree(stage, ignore_errors=True)
        for file, content in outcome.files.items():
            path = stage / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        if (folder / name).exists():
            shutil.rmtree(folder / name)
        stage.rename(folder / name)
    except OSError as error:
        shutil.rmtree(stage, ignore_errors=True)
        raise InputError(
            f"{folder / name}: cannot be written: {error.strerror}; make room and start again; what was finished is "
            "kept"
        ) from error
