"""Flights of a plant with servos of second order at 8 Hz, of which the aircraft file says nothing; commands alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.withheld.drawing import SETS, draw
from bench.withheld.plants.flying import fly
from bench.withheld.plants.instruments import SUITES, record
from bench.withheld.plants.motion import Effects, Instant
from bench.withheld.plants.pilot import Pilot
from bench.withheld.plants.plant import RATE, Plant, handed_over
from sysid_node.aircraft.model import Aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.streams import Streams
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden

SET, SUITE = "development", "autopilot"
SECONDS = 80.0


def flown(manoeuvres: Sequence[str], effects: Effects, air: str, seed: int) -> tuple[Aircraft, Streams]:
    """The aircraft file, off by its tolerances, and what a flight of ``SECONDS`` recorded."""
    drawn = replace(draw(SET, seed), plant="cdrw", effects={}, turbulence=air, servo=8.0)
    plant = Plant(drawn, SET)
    random = np.random.default_rng([SETS[SET], seed, 77])
    airframe, plan = plant.airframe({}), parse_manoeuvre(manoeuvres, plant.truth, RATE, SECONDS)
    planned = {name: plan.deflections[name] for name in airframe.controls} | {"thrust": np.zeros(plan.time.size)}
    gusts = np.zeros((plan.time.size, 6))
    if air != "none":
        dryden = Dryden.at(100.0, plant.truth.geometry.b)
        gusts = INTENSITIES[air] * dryden.realisation(len(gusts), RATE, plant.truth.reference.airspeed, random)

    def pilot(start: Instant) -> Pilot:
        return Pilot(plant.truth, airframe.trim, start, drawn.bandwidth, random, plant.truth.throttle.max_thrust)

    limits = {name: control.limit or 0.5 for name, control in plant.truth.controls.items()}
    log = fly(airframe, effects, pilot, planned, gusts, limits, RATE, drawn.servo)
    file, own = handed_over(plant)
    return file, record(log, plant.seen(log, {}), plant.truth, {}, SUITES[SUITE], 1.0, own)
