"""Flights of known effects for the tests: recorded as a bag would be, and aligned again."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.align import flight_record
from sysid_node.gap.flightdata.gap_flight import GapFlight, completed_flights
from sysid_node.gap.selection.fitted_set import FittedSet, Stage
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

RATE = 100.0
STEPS = [
    "3211:elevator:amplitude=0.06:width=0.3:start=1:every=8:repeat=3",
    "3211:aileron:amplitude=0.06:width=0.25:start=4:every=8:repeat=3",
    "3211:rudder:amplitude=0.12:width=0.3:start=6:every=8:repeat=3",
]


def fly(
    aircraft: Aircraft,
    effects: Mapping[str, Mapping[str, float]],
    seed: int = 1,
    turbulence: str = "none",
    manoeuvre: list[str] | None = None,
    duration: float = 26.0,
) -> GapFlight:
    """A flight of these effects at the hands of the autopilot, 3-2-1-1 on each surface in turn."""
    simulator = Simulator(aircraft, RATE)
    deflections = np.zeros((round(duration * RATE) + 1, 4))
    if manoeuvre != []:
        plan = parse_manoeuvre(STEPS if manoeuvre is None else manoeuvre, aircraft, RATE, duration)
        deflections[:, :3] = plan.surfaces()
    sortie = fly_sortie(simulator, deflections, SortieConditions(effects, turbulence=turbulence, seed=seed))
    record = flight_record(aircraft, FlightSampler(100.0, 100.0, 100.0).record(sortie), 0.2)
    return whole(aircraft, GapFlight(record, 100.0, 100.0, 100.0, source=f"flight {seed}"))


def interrupted(aircraft: Aircraft, flight: GapFlight, first: float, last: float) -> list[GapFlight]:
    """The parts of a flight whose recording lacks what came between two times, s."""
    record = flight.record
    kept = (record.time < first) | (record.time > last)
    columns = {name: values[kept] for name, values in record.columns.items()}
    return completed_flights(aircraft, replace(flight, record=replace(record, time=record.time[kept], columns=columns)))


def whole(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """A flight without an interruption, completed."""
    [one] = completed_flights(aircraft, flight)
    return one


def stage_of(*fitted: FittedSet) -> Stage:
    """A stage of the forward selection in which these sets were likely, and fitted."""
    return Stage([*fitted], [each.added for each in fitted if each.added])
