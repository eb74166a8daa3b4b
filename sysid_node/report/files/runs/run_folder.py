"""The folder of a run: ``summary.json``, the CSV tables and ``report.html``, written and read back."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.interruption import on_interrupt
from sysid_node.online.types import DerivativeEstimate, Estimates
from sysid_node.report.drawing.thinning import MAX_ROWS, thin_curve, thin_flight
from sysid_node.report.files.outputs.output_folder import AIRCRAFT
from sysid_node.report.files.runs import run_tables as tables
from sysid_node.report.files.runs.fault_summary import as_summary, from_summary
from sysid_node.report.pages.run_page import write_report
from sysid_node.report.results.run_result import References, RunData, RunResult
from sysid_node.report.results.signals import Response, RunSignals

SUMMARY = "summary.json"
REPORT = "report.html"


def write_run(folder: Path, run: RunResult) -> None:
    """Writes all files of a run into ``folder``, which is made where it is missing.

    ``sysid report`` makes the same ``report.html`` from the other files. Raises InputError where the folder
    cannot be written.
    """
    stored = _stored(run)
    with _writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        _write_tables(folder, stored)
        text = json.dumps(summary(stored), indent=2, ensure_ascii=False, allow_nan=False)
        (folder / SUMMARY).write_text(text + "\n", encoding="utf-8")
        write_report(folder / REPORT, stored)


def write_aircraft(folder: Path, aircraft: Aircraft) -> None:
    """Writes the aircraft that a run began with beside its other files. Raises InputError where that fails."""
    with _writing(folder):
        (folder / AIRCRAFT).write_text(dump_aircraft(aircraft), encoding="utf-8")


def rebuild_report(folder: Path) -> Path:
    """Draws ``report.html`` from the folder's other files and gives its path. Raises as ``read_run`` does."""
    with _sound(folder):
        _write_aside(folder, read_run(folder))
    return folder / REPORT


@contextmanager
def _sound(folder: Path) -> Iterator[None]:
    """A context that raises InputError where the files of a run have been damaged."""
    try:
        yield
    except InputError:
        raise
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError, csv.Error) as error:
        words = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise InputError(f"{folder}: its files are damaged ({words}); run the command that wrote them again") from error


def _write_aside(folder: Path, run: RunResult) -> None:
    """Write the page under another name, and move it into place."""
    aside = folder / f".{REPORT}"
    with _writing(folder), on_interrupt(lambda: aside.unlink(missing_ok=True)):
        try:
            write_report(aside, run)
            aside.replace(folder / REPORT)
        finally:
            aside.unlink(missing_ok=True)


def read_run(folder: Path) -> RunResult:
    """The run that ``write_run`` wrote. Raises InputError naming the file where something is missing or wrong."""
    with _sound(folder):
        return _read(folder, _read_summary(folder / SUMMARY))


def _read(folder: Path, found: Mapping[str, Any]) -> RunResult:
    """The run of a summary and the tables beside it."""
    return RunResult(
        aircraft=found["aircraft"],
        method=found["method"],
        history=_with_servos(tables.read_history(folder / "estimates.csv", folder / "fits.csv"), found),
        title=found.get("title", ""),
        data=RunData(_from_json(found.get("data_seconds")), found.get("samples", 0), found.get("rejected", {})),
        settings=found.get("settings", {}),
        references=tables.read_references(folder / "derivatives.csv"),
        signals=RunSignals(
            tables.read_signals(folder / "signals.csv"),
            tables.read_spectra(folder / "spectra.csv"),
            tables.read_responses(folder / "responses.csv"),
            found.get("response_note", ""),
        ),
        holdout=_from_json(found.get("holdout", {})),
        faults=from_summary(found.get("faults")),
        remarks=found.get("remarks", []),
    )


def _with_servos(history: list[Estimates], found: Mapping[str, Any]) -> list[Estimates]:
    """The history with what the summary alone holds of its end: servos and budget."""
    if not history:
        return history
    rows = _from_json(found.get("servos", {}))
    servos = {name: DerivativeEstimate(name=name, **row) for name, row in rows.items()}
    return [*history[:-1], replace(history[-1], servos=servos, budget=found.get("budget", {}))]


def summary(run: RunResult) -> dict[str, Any]:
    """The content of ``summary.json``; what is not a finite number is null."""
    final = run.final or Estimates(math.nan, {}, {})
    content = {
        "aircraft": run.aircraft,
        "method": run.method,
        "title": run.title,
        "data_seconds": run.data.seconds,
        "samples": run.data.samples,
        "rejected": run.data.rejected,
        "settings": run.settings,
        "derivatives": {name: _without(d._asdict(), "name") for name, d in final.derivatives.items()},
        "fits": {name: _without(f._asdict(), "coefficient") for name, f in final.fits.items()},
        "servos": {name: _without(d._asdict(), "name") for name, d in final.servos.items()},
        "budget": {name: dict(shares) for name, shares in final.budget.items()},
        "holdout": run.holdout,
        "faults": as_summary(run.faults),
        "remarks": list(run.remarks),
        "response_note": run.signals.response_note,
    }
    plain: dict[str, Any] = _to_json(content)
    return plain


def _stored(run: RunResult) -> RunResult:
    """The part of a run that its files hold: long records thinned, references only of what was estimated."""
    known = run.final.derivatives if run.final else {}
    return replace(
        run,
        history=[e for e in run.history if e.derivatives or e.fits],
        references=References(
            {name: prior for name, prior in run.references.prior.items() if name in known},
            {name: value for name, value in run.references.truth.items() if name in known},
            {name: time for name, time in run.references.truth_since.items() if name in known},
        ),
        signals=replace(
            run.signals,
            flight=thin_flight(run.signals.flight) if run.signals.flight else None,
            responses={name: _thin_response(response) for name, response in run.signals.responses.items()},
        ),
    )


def _thin_response(response: Response) -> Response:
    curves = thin_curve(response.time, response.measured, response.modelled, points=MAX_ROWS)
    return Response(response.unit, *curves)


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Turns an error of the file system into an InputError of one line."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); give another folder") from None


def _write_tables(folder: Path, run: RunResult) -> None:
    final = run.final.derivatives.values() if run.final else ()
    tables.write_derivatives(folder / "derivatives.csv", final, run.references)
    tables.write_estimates(folder / "estimates.csv", run.history)
    tables.write_fits(folder / "fits.csv", run.history)
    tables.write_signals(folder / "signals.csv", run.signals.flight)
    tables.write_spectra(folder / "spectra.csv", run.signals.spectra)
    tables.write_responses(folder / "responses.csv", run.signals.responses)


def _read_summary(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"{path.parent}: no {SUMMARY} in it; give the --out folder of sysid replay or sysid identify"
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as JSON ({error}); run the command that wrote it again") from None
    if not isinstance(found, dict) or not {"aircraft", "method"} <= found.keys():
        raise InputError(f"{path}: keys 'aircraft' and 'method' are expected; run the command that wrote it again")
    return found


def _without(values: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in values.items() if name != key}


def _to_json(value: Any) -> Any:
    """Plain JSON values: NumPy scalars unpacked, tuples as lists, what is not finite as null."""
    if isinstance(value, Mapping):
        return {str(key): _to_json(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_to_json(part) for part in value]
    if hasattr(value, "tolist"):
        return _to_json(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _from_json(value: Any) -> Any:
    """Figures as they were before ``_to_json``: null is NaN."""
    if isinstance(value, Mapping):
        return {key: _from_json(part) for key, part in value.items()}
    return math.nan if value is None else value
