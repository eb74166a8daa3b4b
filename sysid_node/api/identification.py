"""Flights identified by a batch method."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.opposite_estimates import opposite_estimates
from sysid_node.api.compiled_programs import release_compiled_programs
from sysid_node.api.estimated_run import EstimatedRun
from sysid_node.api.flight_file import FlightFile, flight_list, read_alike, refuse_other_aircraft
from sysid_node.batch.identify import METHODS, Identification, refuse_unused
from sysid_node.batch.identify import identify as identify_records
from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError, InputWarning, noted_warnings
from sysid_node.flight.truth import read_truth
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.report.files.runs.batch_tables import write_batch_tables
from sysid_node.report.files.runs.run_folder import REPORT, write_aircraft, write_run
from sysid_node.report.results.from_identification import identification_result
from sysid_node.report.results.run_result import RunResult


@dataclass(frozen=True, repr=False)
class BatchIdentification(EstimatedRun):
    """The result of a batch method. ``identification`` holds the fit with its correlations and residuals."""

    run: RunResult
    identification: Identification
    aircraft: Aircraft

    def write(self, folder: Path) -> None:
        """Write what ``sysid identify`` writes into a folder that holds nothing else. Raises InputError."""
        write_run(folder, self.run)
        write_aircraft(folder, self.aircraft)
        write_batch_tables(folder, self.identification)

    def save(self, folder: str | Path, *, force: bool = False) -> Path:
        """Write what ``sysid identify`` writes; returns the path of the report.

        Raises InputError where the folder holds anything but an earlier identification and ``force`` is not given, or
        cannot be written.
        """
        with output_folder(folder, "identify", force=force) as out:
            out.publish(self.write)
        return Path(folder) / REPORT


def identify(
    flights: FlightFile | Sequence[FlightFile],
    method: str,
    settings: Mapping[str, object] | None = None,
    *,
    holdout: FlightFile | Sequence[FlightFile] = (),
    progress: Callable[[float, str], None] | None = None,
) -> BatchIdentification:
    """Estimates an aircraft's derivatives from whole flights, and checks them on flights that are held out.

    ``flights``: one or several of the same aircraft. ``method``: as of ``sysid identify --method``, e.g.
    ``"equation_error"``, ``"output_error"`` or ``"filter_error"``. ``settings``: as of ``--set``. ``progress`` is
    called with the share done (0..1) and what is being done.

    Raises InputError where a setting, the method or a flight is not as it must be.
    """
    flights, held = flight_list(flights, "flights"), flight_list(holdout, "holdout")
    if not flights:
        raise InputError("no flight to identify from; give at least one")
    refuse_other_aircraft([*flights, *held])
    if method not in METHODS:
        raise InputError(f"method {method!r}: expected one of {', '.join(METHODS)}")
    chosen = BatchSettings.from_mapping(settings or {})
    refuse_unused(method, settings or {})
    tell = progress or (lambda share, doing: None)
    tell(0.0, "reading the flights")
    noted: list[str] = []
    with noted_warnings(noted):
        every = read_alike(
            [*flights, *held],
            chosen.actuators,
            lambda flight, carried: flight.aligned(chosen.max_gap, carried),
            lambda record: record.commanded,
        )
        records, held_out = every[: len(flights)], every[len(flights) :]
        tell(0.2, method.replace("_", " "))
        release_compiled_programs()
        aircraft = flights[0].aircraft
        found = identify_records(method, aircraft, records, chosen, held_out)
    if not found.fit.search.converged:
        warnings.warn(f"{method.replace('_', ' ')}: {found.fit.search.message}", InputWarning, stacklevel=2)
    tell(0.9, "spectra")
    result = identification_result(aircraft, records, found, chosen, read_truth(flights[0].path))
    opposite = opposite_estimates(aircraft, result.final.derivatives) if result.final else []
    for text in opposite:
        warnings.warn(f"{records[0].name}: {text}", InputWarning, stacklevel=2)
    result = replace(result, remarks=[*noted, *opposite, *result.remarks])
    return BatchIdentification(result, found, aircraft)
