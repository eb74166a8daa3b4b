"""The way that a user takes: a log converted to a bag, the bag replayed with an aircraft file."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from bench.estimation.real.dimensional import Frequencies
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.main import main as sysid
from sysid_node.flight.csv import write_csv
from sysid_node.flight.record import FlightRecord

METHODS = ("sls_rft", "iv_rft")


class Found(NamedTuple):
    """A derivative as ``summary.json`` has it."""

    value: float
    error: float
    status: str


class Replayed(NamedTuple):
    """What a replay found: derivatives by name, and how much of each coefficient's motion they explain."""

    derivatives: dict[str, Found]
    r_squared: dict[str, float]


def replay(
    flight: FlightRecord, aircraft: Aircraft, method: str = "sls_rft", frequencies: Frequencies | None = None
) -> Replayed:
    """``sysid convert`` and ``sysid replay`` in a temporary folder; every sample counts."""
    settings = ["--set", "settle_time=0", "--set", f"method={method}"]
    if frequencies is not None:
        settings += ["--frequencies", ":".join(str(f) for f in frequencies)]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, file, bag, out = (folder / part for part in ("log.csv", "aircraft.yaml", "bag", "out"))
        write_csv(log, flight)
        file.write_text(dump_aircraft(aircraft), encoding="utf-8")
        _run("convert", log, "--aircraft", file, "--out", bag, "--quiet")
        _run("replay", bag, "--aircraft", file, "--out", out, "--quiet", *settings)
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    derivatives = {name: _found(d) for name, d in summary["derivatives"].items()}
    return Replayed(derivatives, {name: fit["r_squared"] for name, fit in summary["fits"].items()})


def replays(
    flight: FlightRecord, aircraft: Aircraft, frequencies: Frequencies | None = None, methods: Sequence[str] = METHODS
) -> dict[str, Replayed]:
    """What each method finds."""
    return {method: replay(flight, aircraft, method, frequencies) for method in methods}


def _run(*arguments: object) -> None:
    code = sysid([str(argument) for argument in arguments])
    if code:
        raise SystemExit(code)


def _found(derivative: dict[str, Any]) -> Found:
    """JSON has no NaN and no infinity: what is not known is null."""
    value, error = derivative["value"], derivative["standard_error"]
    return Found(math.nan if value is None else value, math.inf if error is None else error, derivative["status"])
