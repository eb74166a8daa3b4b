"""The scene of a folder of ``sysid replay``, ``sysid identify`` or ``sysid demo``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.recorded_flight import FaultVerdict
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.report.files.runs.run_folder import read_run
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.wording.names import COEFFICIENT_WORDS
from sysid_node.view.bodies import body_of_record, shape_of_aircraft
from sysid_node.view.flight_path import filled
from sysid_node.view.forces import missing_arrows
from sysid_node.view.panels import (
    control_lanes,
    derivative_tabs,
    estimate_notes,
    motion_panels,
    residual_panels,
)
from sysid_node.view.scene import NOTHING, VERMILION, Arrow, Lane, LaneChange, Note, Scene

#: What the colours of the derivatives' plots mean.
COLOURS = (
    "In the plots of derivatives: blue the estimate, light blue its 95 % interval, pale an estimate that is not valid, "
    "orange the aircraft file, green the truth where it is known."
)


def scene_of_run(folder: Path, aircraft: Aircraft | None) -> Scene:
    """The flight as measured, with the estimates, residuals and faults of the run. Raises InputError."""
    run = read_run(folder)
    flight = run.signals.flight
    arrows = _arrows(run, flight, aircraft) if flight is not None else []
    bodies = [] if flight is None else [body_of_record(flight, "measured", arrows=arrows)]
    tabs = derivative_tabs(run.history, run.references) if len(run.history) > 1 else {}
    if flight is not None:
        tabs["Flight"] = motion_panels(flight)
    responses = {name: (r.time, r.measured, r.modelled) for name, r in run.signals.responses.items()}
    tabs["Residuals"] = residual_panels(responses, COEFFICIENT_WORDS)
    return Scene(
        title=run.heading,
        about=_about(run, flight, arrows, aircraft),
        shape=shape_of_aircraft(aircraft),
        bodies=bodies,
        tabs={title: panels for title, panels in tabs.items() if panels},
        lanes=[*(control_lanes(flight) if flight is not None else []), *fault_lanes(run.faults)],
        notes=[*estimate_notes(run.history if len(run.history) > 1 else []), *_fault_notes(run.faults)],
    )


def fault_lanes(faults: FaultVerdict | None) -> list[Lane]:
    """A lane for each part that failed, from the fault's onset to its end."""
    lanes = []
    for episode in faults.episodes if faults else ():
        fault = episode.fault
        end = [] if episode.until is None else [LaneChange(episode.until, NOTHING)]
        changes = [LaneChange(0.0, NOTHING), LaneChange(fault.since, fault.kind), *end]
        lanes.append(Lane(f"fault: {fault.part}", changes, VERMILION))
    return lanes


def _fault_notes(faults: FaultVerdict | None) -> list[Note]:
    return [Note(one.fault.found, f"fault found: {one.text}", "ERROR") for one in (faults.episodes if faults else ())]


def _arrows(run: RunResult, flight: FlightRecord, aircraft: Aircraft | None) -> list[Arrow]:
    """Measured minus modelled force and moment, from the responses of the coefficients."""
    found = {c: r for c, r in run.signals.responses.items() if c in COEFFICIENT_WORDS}
    if aircraft is None or not found:
        return []
    time = next(iter(found.values())).time
    left = {c: np.interp(time, r.time, r.measured - r.modelled) for c, r in found.items()}
    airspeed, alpha, density = (_at(time, flight, name) for name in ("V", "alpha", "rho"))
    if not density.any():
        density = np.full_like(time, aircraft.reference.air_density)
    return missing_arrows(time, left, (airspeed, alpha, density), aircraft.geometry)


def _at(time: Array, flight: FlightRecord, column: str) -> Array:
    return np.interp(time, flight.time, filled(flight.time, flight[column]))


def _about(run: RunResult, flight: FlightRecord | None, arrows: Sequence[Arrow], aircraft: Aircraft | None) -> str:
    from markupsafe import Markup  # noqa: PLC0415

    from sysid_node.report.sections import opening  # noqa: PLC0415

    words = [f"# {run.heading}", Markup(opening.context(run)["paragraph"]).striptags()]
    words += [f"- {remark}" for remark in run.remarks]
    words += [COLOURS] if len(run.history) > 1 else []
    words += body_words(flight, arrows, aircraft, run.aircraft)
    return "\n\n".join(words)


def body_words(flight: FlightRecord | None, arrows: Sequence[Arrow], aircraft: Aircraft | None, name: str) -> list[str]:
    """Sentences on what the space shows, and what is missing there and why."""
    words = []
    if flight is not None and not (flight.measured("phi") and flight.measured("theta")):
        words.append("Roll and pitch were not recorded: the aircraft stands level, and its way is not drawn.")
    elif flight is not None:
        words.append("The way is integrated from airspeed, flow angles and attitude: it is one through the air.")
    if aircraft is None:
        words.append(f"The aircraft file of {name} was not given (`--aircraft`): spans and forces are not to scale.")
    words += [f"{a.name.capitalize()}: 1 m of its arrow is {1.0 / a.metres_per_unit:.3g} {a.unit}." for a in arrows]
    return words
