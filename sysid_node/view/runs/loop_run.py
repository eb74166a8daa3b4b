"""The scene of a folder of ``sysid loop``: attitude, tracking, excitation, the failure, and what the nodes reported."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array
from sysid_node.report.files.loop_folder import read_loop
from sysid_node.report.results.closed_loop import ClosedLoopFlight
from sysid_node.view.bodies import shape_of_aircraft
from sysid_node.view.flight_path import attitude_of, filled
from sysid_node.view.panels import DEGREES
from sysid_node.view.scene import (
    BLUE,
    GREY,
    NOTHING,
    PALE,
    VERMILION,
    Body,
    Lane,
    LaneChange,
    Note,
    PlotCurve,
    PlotPanel,
    Scene,
)


def scene_of_loop(folder: Path, content: dict[str, Any], aircraft: Aircraft | None) -> Scene:
    """The flight of the folder. Raises InputError where its table is missing."""
    flight = read_loop(folder, content)
    time = np.asarray(flight.time)
    flown = {axis: _flown(flight, axis) for axis in flight.commanded}
    level = np.zeros_like(time)
    turns = [filled(time, flown.get(axis, level)) for axis in ("roll", "pitch")]
    body = Body("flown", PALE, time, np.zeros((time.size, 3)), attitude_of(turns[0], turns[1], level))
    return Scene(
        title=f"{flight.aircraft} in closed loop",
        about=_about(flight),
        shape=shape_of_aircraft(aircraft),
        bodies=[body],
        tabs={"Tracking": _panels(flight, time, flown)},
        lanes=_lanes(flight),
        notes=[Note(e.time, f"{e.node}: {e.text}", "ERROR" if e in flight.alarms else "INFO") for e in flight.events],
    )


def _flown(flight: ClosedLoopFlight, axis: str) -> Array:
    return np.add(flight.commanded[axis], flight.errors[axis], dtype=np.float64)


def _panels(flight: ClosedLoopFlight, time: Array, flown: dict[str, Array]) -> list[PlotPanel]:
    """Angles flown and commanded, then the errors, deg."""
    panels = [
        PlotPanel(axis, "deg", [
            PlotCurve("commanded", time, DEGREES * np.asarray(flight.commanded[axis]), GREY, 1.5),
            PlotCurve("flown", time, DEGREES * values, BLUE, 1.5),
        ])
        for axis, values in flown.items()
    ]  # fmt: skip
    errors = [
        PlotPanel(f"{axis}, tracking error", "deg", [PlotCurve("error", time, DEGREES * np.asarray(values), VERMILION)])
        for axis, values in flight.errors.items()
    ]
    return [*panels, *errors]


def _lanes(flight: ClosedLoopFlight) -> list[Lane]:
    excited = [
        change for begin, end in flight.excited for change in (LaneChange(begin, "excites"), LaneChange(end, NOTHING))
    ]
    lanes = [Lane("exciter", [LaneChange(0.0, NOTHING), *excited])]
    if flight.failed:
        lanes.append(Lane("failure", [LaneChange(0.0, NOTHING), LaneChange(flight.onset, flight.failure)], VERMILION))
    return lanes


def _about(flight: ClosedLoopFlight) -> str:
    gains = "gains that follow the identified model" if flight.adapted else "the fixed gains of the aircraft file"
    failure = f"At {flight.onset:.0f} s this failure begins: `{flight.failure}`." if flight.failed else ""
    attitude = "The aircraft stands at one place and shows roll and pitch: the folder holds no airspeed."
    return f"# {flight.aircraft} in closed loop\n\nFlown with {gains}. {failure}\n\n{attitude}"
