"""Aircraft in space, from flights and from aircraft files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.view.aircraft_mesh import shape_of
from sysid_node.view.flight_path import poses
from sysid_node.view.scene import GREY, Arrow, Body, Colour, DrawnAircraft

#: Poses a second that are enough for the eye.
_RATE = 50.0


def body_of_record(
    record: FlightRecord, name: str, colour: Colour = GREY, arrows: Sequence[Arrow] = (), *, path: bool = True
) -> Body:
    """The aircraft of a flight, at most fifty poses a second; its controls are the record's de, da and dr."""
    found = poses(record)
    step = float(np.median(np.diff(record.time)))
    rows = slice(None, None, max(round(1.0 / (_RATE * step)), 1))
    controls = {symbol: record[symbol][rows] for symbol in ("de", "da", "dr") if record.measured(symbol)}
    return Body(
        name, colour, record.time[rows], found.position[rows], found.attitude[rows], controls, arrows,
        path and found.known,
    )  # fmt: skip


def shape_of_aircraft(aircraft: Aircraft | None) -> DrawnAircraft:
    """The shape with the file's span, chord and signs; a common one without a file."""
    if aircraft is None:
        return DrawnAircraft()
    values = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    return shape_of(aircraft.geometry.b, aircraft.geometry.cbar, values)


def aircraft_for(given: str | Path | None, name: str) -> Aircraft | None:
    """The aircraft file that was given, else the shipped one of a run's name; None where there is none of that name.

    Raises InputError where the one that was given cannot be read.
    """
    if given is not None:
        return load_aircraft(given)
    try:
        return load_aircraft(name)
    except InputError:
        return None
