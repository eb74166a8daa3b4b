"""The scene of a folder of ``sysid gap``: the flight as measured, and as the simulator flies it before and after."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.report.files.gap_flights import FLIGHTS, MISSING, STAGES, FlightTable, read_flights
from sysid_node.report.wording.names import COEFFICIENT_WORDS, words_of
from sysid_node.view.bodies import shape_of_aircraft
from sysid_node.view.flight_path import attitude_of, earth_velocity, filled, integrated
from sysid_node.view.forces import missing_arrows
from sysid_node.view.panels import MOTION, SURFACES, control_lanes
from sysid_node.view.scene import (
    BLUE,
    GREEN,
    PALE,
    PURPLE,
    SKY,
    VERMILION,
    Arrow,
    Body,
    Colour,
    PlotCurve,
    PlotPanel,
    Scene,
)

#: What each stage is called on the screen, and its colour.
NAMES = {"measured": "measured", "file": "simulated, aircraft file", "corrected": "simulated, corrected"}
COLOURS: Mapping[str, Colour] = {"measured": PALE, "file": VERMILION, "corrected": BLUE}

#: How far beside the measured aircraft the simulated ones fly, in spans: by the file at its left, corrected right.
_BESIDE = 1.2

_ANGLES = ("phi", "theta", "psi")

_ARROWS = (("missing force", "missing moment"), ("missing force, corrected", "missing moment, corrected"))
_ARROW_COLOURS = ((VERMILION, PURPLE), (SKY, GREEN))


def scene_of_gap(folder: Path, content: Mapping[str, Any], aircraft: Aircraft | None) -> Scene:
    """The longest flight on which the gap was measured. Raises InputError where its table is missing."""
    flights = read_flights(folder / FLIGHTS)
    flight = max(flights, key=lambda each: each.time.size)
    record = _measured(flight)
    arrows, shape = _arrows(flight, record, aircraft), shape_of_aircraft(aircraft)
    return Scene(
        title=f"The simulator against the flight: {content.get('aircraft', '')}",
        about=_about(content, len(flights), arrows),
        shape=shape,
        bodies=_bodies(flight, arrows, shape.span),
        tabs={"Flown and simulated": _readings(flight), "Missing forces and moments": _missing(flight)},
        lanes=control_lanes(record),
    )


def _measured(flight: FlightTable) -> FlightRecord:
    """The flight's measured columns as a record, its controls under their symbols."""
    columns = {n.removeprefix("measured_"): v for n, v in flight.columns.items() if n.startswith("measured_")}
    symbols = {name: symbol for symbol, name in SURFACES.items()}
    for name, values in flight.columns.items():
        if name.startswith("command_"):
            control = name.removeprefix("command_")
            columns[symbols.get(control, control)] = values
    return FlightRecord(flight.time, columns | {"rho": flight["rho"]})


def _bodies(flight: FlightTable, arrows: list[Arrow], span: float) -> list[Body]:
    """The aircraft as measured, and the simulated ones beside it, so that none hides another."""
    measured = _pose(flight, "measured")
    if measured is None:
        level = np.tile([1.0, 0.0, 0.0, 0.0], (flight.time.size, 1))
        return [Body(NAMES["measured"], PALE, flight.time, np.zeros((flight.time.size, 3)), level, {}, arrows)]
    controls = {s: flight[f"command_{n}"] for s, n in SURFACES.items() if f"command_{n}" in flight.columns}
    bodies = [Body(NAMES["measured"], PALE, flight.time, *measured, controls, arrows, path=True)]
    heading = filled(flight.time, flight["measured_psi"])
    right = np.column_stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)])
    for stage, side in zip(STAGES[1:], (-_BESIDE, _BESIDE), strict=True):
        pose = _pose(flight, stage)
        if pose is not None:
            position = pose[0] + side * span * right
            bodies.append(Body(NAMES[stage], COLOURS[stage], flight.time, position, pose[1], controls))
    return bodies


def _pose(flight: FlightTable, stage: str) -> tuple[Array, Array] | None:
    """Position and attitude of a stage; a simulated one leaves the measured way where the simulator starts again."""
    angles = [flight[f"{stage}_{name}"] for name in _ANGLES]
    if not all(np.isfinite(values).any() for values in angles[:2]):
        return None
    turns = [np.unwrap(filled(flight.time, values)) for values in angles]
    attitude = attitude_of(turns[0], turns[1], turns[2])
    position = integrated(flight.time, _velocity(flight, stage, attitude))
    if stage != "measured":
        along = _pose(flight, "measured")
        begins = np.maximum.accumulate(np.where(flight["begins"] == 1.0, np.arange(flight.time.size), 0))
        position = position - position[begins] + (along[0][begins] if along else 0.0)
    return position, attitude


def _velocity(flight: FlightTable, stage: str, attitude: Array) -> Array:
    air = (filled(flight.time, flight[f"{stage}_{name}"]) for name in ("V", "alpha", "beta"))
    return earth_velocity(attitude, *air)


def _arrows(flight: FlightTable, record: FlightRecord, aircraft: Aircraft | None) -> list[Arrow]:
    """The force and the moment that the simulator lacks before and after the correction, to one scale."""
    if aircraft is None:
        return []
    flow = tuple(filled(flight.time, values) for values in (record["V"], record["alpha"], record["rho"]))
    found: list[Arrow] = []
    for stage, names, colours in zip(MISSING, _ARROWS, _ARROW_COLOURS, strict=True):
        left = {c: filled(flight.time, flight[f"{stage}_{c}"]) for c in COEFFICIENT_WORDS}
        left = {c: values - values.mean() for c, values in left.items()}  # constant offsets are not compared
        arrows = missing_arrows(flight.time, left, flow, aircraft.geometry, names, colours)  # type: ignore[arg-type]
        scales = [arrow.metres_per_unit for arrow in (found or arrows)]
        found += [_scaled(arrow, scale) for arrow, scale in zip(arrows, scales, strict=True)]
    return found


def _scaled(arrow: Arrow, scale: float) -> Arrow:
    return Arrow(arrow.name, arrow.unit, arrow.time, arrow.vectors, arrow.colour, scale)


def _readings(flight: FlightTable) -> list[PlotPanel]:
    """Each reading as measured, with the aircraft file, and corrected; a line ends where the simulator starts again."""
    panels = []
    for _, unit, factor, columns in MOTION:
        for column, name in columns.items():
            series = {s: factor * flight[f"{s}_{column}"] for s in STAGES}
            if not any(np.isfinite(values).any() for values in series.values()):
                continue
            restarts = flight["begins"] == 1.0
            series |= {s: np.where(restarts, np.nan, series[s]) for s in STAGES[1:]}
            curves = [
                PlotCurve(NAMES[s], flight.time, values, COLOURS[s], width)
                for (s, values), width in zip(series.items(), (4.0, 1.2, 1.5), strict=True)
            ]
            panels.append(PlotPanel(name, unit, curves))
    return panels


def _missing(flight: FlightTable) -> list[PlotPanel]:
    """Coefficients that the simulator lacks, before and after the correction."""
    panels = []
    for coefficient, words in COEFFICIENT_WORDS.items():
        curves = [
            PlotCurve(NAMES[stage], flight.time, flight[f"{missing}_{coefficient}"], COLOURS[stage])
            for stage, missing in zip(STAGES[1:], MISSING, strict=True)
        ]
        if np.isfinite(curves[0].values).any():
            panels.append(PlotPanel(words, "", curves))
    return panels


def _starts(gap: Mapping[str, Any]) -> str:
    """How often the simulator starts again, where short flights are shown."""
    if gap.get("measured_by") != "short_flights":
        return ""
    return f" The simulator starts again from the measured state every {gap['window_s']:g} s."


def _about(content: Mapping[str, Any], flights: int, arrows: list[Arrow]) -> str:
    gap = content["gap"]
    causes = ", ".join(words_of(cause["label"]) for cause in content["causes"]) or "none"
    words = [
        f"# {words_of(content['verdict']).capitalize()}",
        f"Causes: {causes}.",
        f"Error of the simulator: {_percent(gap['before'])} of the motion with the aircraft file, "
        f"{_percent(gap['after'])} corrected; {_percent(gap['noise_floor'])} is noise.",
        "Pale, in the middle: as measured. Orange, at its left: as the simulator flies it with the aircraft file. "
        f"Blue, at its right: corrected.{_starts(gap)}",
        *(
            f"{a.name.capitalize()}: 1 m of its arrow is {1.0 / a.metres_per_unit:.3g} {a.unit}; a second arrow, "
            "to the same scale, is what is still missing after the correction."
            for a in arrows[:2]
        ),
    ]
    if flights > 1:
        words.append(f"The longest of {flights} flights, or parts of flights, is shown.")
    return "\n\n".join(words)


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
