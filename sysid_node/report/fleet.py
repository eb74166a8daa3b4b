"""Writes what ``sysid fleet`` leaves beside its state: the page, the tables, and an aircraft file for each tail."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.fleet.results import FleetResults
from sysid_node.fleet.statistics.prior import tail_aircraft
from sysid_node.fleet.statistics.summary import FleetSummary
from sysid_node.report.files.fleet_tables import write_fleet_tables
from sysid_node.report.pages.fleet_page import write_fleet_report
from sysid_node.report.results.fleet_report import FleetReport

#: The folder of the tails' aircraft files.
TAILS = "tails"


def write(
    results: FleetResults,
    summary: FleetSummary,
    folder: Path,
    files: Mapping[str, Aircraft] | None = None,
    tail_files: Mapping[tuple[str, str], Aircraft] | None = None,
) -> None:
    """Write ``report.html``, the tables, and ``tails/<tail>.yaml`` for every tail whose type has a file in ``files``.

    ``tail_files``: by type and tail the file from which a tail's own is made, where it is not the type's.
    Where two types have a tail of one name, its file is ``tails/<type>-<tail>.yaml``.
    The folder must be there; files of the same names are replaced. Raises InputError where one cannot be written.
    """
    report = FleetReport(results, summary, files or {}, tail_files or {})
    try:
        write_fleet_report(folder / "report.html", report)
        write_fleet_tables(folder, report)
        _write_tails(folder / TAILS, report)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); give another folder") from error


def _write_tails(folder: Path, report: FleetReport) -> None:
    for (aircraft, tail), priors in report.summary.priors.items():
        file = report.tail_files.get((aircraft, tail), report.files.get(aircraft))
        if file is not None:
            folder.mkdir(exist_ok=True)
            text = dump_aircraft(tail_aircraft(file, tail, priors))
            name = f"{aircraft}-{tail}" if report.summary.is_ambiguous(tail) else tail
            (folder / f"{file_name(name)}.yaml").write_text(text, encoding="utf-8")


def file_name(tail: str) -> str:
    """A tail's name as the name of a file: what could lead out of the folder becomes an underscore."""
    return re.sub(r"[^\w.+ -]", "_", tail)[:100].lstrip(". ") or "tail"
