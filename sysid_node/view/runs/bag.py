"""The scene of a bag or a log of a flight."""

from __future__ import annotations

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import FlightRecord
from sysid_node.view.bodies import body_of_record, shape_of_aircraft
from sysid_node.view.panels import control_lanes, motion_panels
from sysid_node.view.runs.estimator_run import body_words
from sysid_node.view.scene import Scene


def scene_of_flight(record: FlightRecord, aircraft: Aircraft | None) -> Scene:
    """The flight as measured."""
    words = [
        f"# {record.name}",
        f"{record.duration:.1f} s, {len(record)} samples.",
        *body_words(record, (), aircraft, ""),
    ]
    return Scene(
        title=record.name,
        about="\n\n".join(words),
        shape=shape_of_aircraft(aircraft),
        bodies=[body_of_record(record, "measured")],
        tabs={"Flight": motion_panels(record)},
        lanes=control_lanes(record),
    )
