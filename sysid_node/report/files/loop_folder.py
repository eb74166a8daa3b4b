"""The folder of ``sysid loop``: ``summary.json``, ``tracking.csv`` and the report, written and read back."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.files.runs.run_tables import read_columns
from sysid_node.report.pages.closed_loop_page import write_loop
from sysid_node.report.results.closed_loop import ClosedLoopFlight, Event

TRACKING = "tracking.csv"


def write_loop_folder(folder: Path, flight: ClosedLoopFlight) -> None:
    """Write ``summary.json``, ``tracking.csv`` (commands and errors, rad, against time, s) and ``report.html``."""
    columns = {f"{axis}_commanded": values for axis, values in flight.commanded.items()}
    columns |= {f"{axis}_error": values for axis, values in flight.errors.items()}
    rows = zip(flight.time, *columns.values(), strict=True)
    write_table(folder / TRACKING, ["time", *columns], rows, blank_nan=True)
    (folder / "summary.json").write_text(json.dumps(flight.summary(), indent=2) + "\n", encoding="utf-8")
    write_loop(folder, flight)


def read_loop(folder: Path, content: dict[str, Any]) -> ClosedLoopFlight:
    """The flight of a folder, ``content`` being that of its ``summary.json``. Raises InputError."""
    columns = read_columns(folder / TRACKING, "time")
    if not columns or "onset" not in content:
        raise InputError(f"{folder}: written by an earlier version of sysid loop; fly again")
    groups = {
        end: {name.removesuffix(end): column.tolist() for name, column in columns.items() if name.endswith(end)}
        for end in ("_commanded", "_error")
    }
    return ClosedLoopFlight(
        aircraft=content["aircraft"],
        failure=content["failure"],
        onset=content["onset"],
        adapted=content["adapted"],
        time=columns["time"].tolist(),
        errors=groups["_error"],
        commanded=groups["_commanded"],
        estimates={name: _estimate(name, values) for name, values in content["derivatives"].items()},
        events=[Event(event["time"], event["node"], event["what"]) for event in content["events"]],
        troubles=content["message_troubles"],
    )


def _estimate(name: str, values: dict[str, Any]) -> DerivativeEstimate:
    numbers = [math.nan if values[key] is None else values[key] for key in ("value", "lower", "upper")]
    value, lower, upper = numbers
    return DerivativeEstimate(name, value, math.nan, lower, upper, values["status"] == "ok", values["status"])
