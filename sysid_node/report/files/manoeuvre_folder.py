"""The folder of a designed manoeuvre: its tables, ``summary.json``, the report, and the predicted flight as a bag."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.report.pages.manoeuvre_page import write_manoeuvre_report
from sysid_node.report.results.manoeuvre_result import ManoeuvreResult

FLIGHT_BAG = "flight"


def write_manoeuvre(folder: Path, result: ManoeuvreResult) -> None:
    """Write manoeuvre.csv, prediction.csv, correlations.csv, summary.json, report.html and the bag ``flight``.

    Raises InputError where the folder cannot be written or holds such a bag.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _write_tables(folder, result)
        text = json.dumps(summary(result), indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
        write_manoeuvre_report(folder / "report.html", result)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error}; give another folder as --out") from error
    write_streams(folder / FLIGHT_BAG, streams_from_record(result.prediction.flight, result.aircraft))


def summary(result: ManoeuvreResult) -> dict[str, Any]:
    """The content of ``summary.json``; a derivative that the flight does not show has no standard error: null."""
    information, plan = result.prediction.information, result.prediction.manoeuvre
    errors = (None if math.isinf(error) else error for error in information.standard_errors.tolist())
    tolerances = (derivative.tolerance for derivative in result.aircraft.derivatives.values())
    rows = zip(information.names, information.values.tolist(), tolerances, errors, strict=True)
    content = {
        "aircraft": result.aircraft.name,
        "manoeuvre": plan.spec,
        "duration": plan.duration,
        "autopilot": result.autopilot,
        "largest_deflections": {name: float(np.abs(plan.deflections[name]).max()) for name in plan.moved},
        "envelope_excess": result.envelope.excess(result.prediction.flight),
        "derivatives": {name: {"value": v, "tolerance": t, "standard_error": e} for name, v, t, e in rows},
        "correlated": [{"pair": [a, b], "correlation": c} for a, b, c in information.pairs()],
    }
    if result.optimum is not None:
        content["optimisation"] = {
            "start": result.optimum.start.manoeuvre.spec,
            "left_start": result.optimum.cost_start,
            "left_best": result.optimum.cost_best,
            "counted": list(result.optimum.counted),
            "evaluations": result.optimum.evaluations,
        }
    return content


def _write_tables(folder: Path, result: ManoeuvreResult) -> None:
    plan, information = result.prediction.manoeuvre, result.prediction.information
    times = zip(plan.time.tolist(), *(values.tolist() for values in plan.deflections.values()), strict=True)
    write_table(folder / "manoeuvre.csv", ["t", *plan.deflections], times)
    tolerances = [d.tolerance for d in result.aircraft.derivatives.values()]
    numbers = (information.values.tolist(), tolerances, information.standard_errors.tolist())
    rows = zip(information.names, *numbers, strict=True)
    write_table(folder / "prediction.csv", ["name", "value", "tolerance", "standard_error"], rows)
    matrix = zip(information.names, *information.correlations.T.tolist(), strict=True)
    write_table(folder / "correlations.csv", ["name", *information.names], matrix)
