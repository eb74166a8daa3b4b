"""Flights of a reality as bags, with an autopilot, real instruments and turbulence."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.withheld.jsbsim.reality import Reality, Withheld
from bench.withheld.plants.instruments import SUITES, Log, readings, record
from bench.withheld.plants.pilot import RATE as PILOT_RATE
from bench.withheld.plants.pilot import Pilot
from sysid_node.aircraft.model import Aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.bag.writer import write_streams
from sysid_node.sim.importing.jsbsim.survey import ModelSurvey
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden

RATE, LOOK = 400.0, 2  # Hz, and steps between two looks at the motion
SECONDS, HEIGHT = 44.0, 300.0

#: The flight that is fitted and the one held out.
MANOEUVRES = ("3211:repeat=2", "multisine")


def write_flights(
    folder: Path, survey: ModelSurvey, aircraft: Aircraft, withheld: Withheld, turbulence: str, seed: int
) -> None:
    """Bags ``fitted`` and ``held`` of two flights. Raises DivergedError."""
    for place, name in enumerate(("fitted", "held")):
        random = np.random.default_rng([seed, place])
        log = flown(survey, aircraft, withheld, turbulence, MANOEUVRES[place], random)
        seen = readings(log, aircraft, {})
        streams = record(log, seen, aircraft, {}, SUITES["research"], 1.0, random)
        write_streams(folder / name, streams)


def flown(
    survey: ModelSurvey,
    aircraft: Aircraft,
    withheld: Withheld,
    turbulence: str,
    manoeuvre: str,
    random: np.random.Generator,
) -> Log:
    """One flight at ``RATE``. Raises DivergedError."""
    reality = Reality(survey, aircraft, withheld, RATE)
    air, own = random.spawn(2)
    plan = parse_manoeuvre(manoeuvre, aircraft, RATE, SECONDS)
    planned = {name: plan.deflections[name] for name in reality.controls}
    full = (aircraft.throttle and aircraft.throttle.max_thrust) or 1.0
    planned["thrust"] = plan.deflections["throttle"] * full

    now = reality.start()
    hands = Pilot(aircraft, reality.trim, now, 1.0, own, full)
    gusts = np.zeros((plan.time.size, 6))
    if INTENSITIES[turbulence]:
        dryden = Dryden.at(HEIGHT, aircraft.geometry.b)
        gusts = INTENSITIES[turbulence] * dryden.realisation(len(gusts), RATE, aircraft.reference.airspeed, air)
    names = (*reality.controls, "thrust")
    moments, given, command = [], [], dict(reality.trim)
    for k, row in enumerate(gusts.tolist()):
        if k % LOOK == 0:
            if k % round(RATE / PILOT_RATE) == 0:
                command = hands.command({n: float(planned[n][k]) for n in names}, now)
                command["thrust"] = min(max(command["thrust"], 0.0), full)
            moments.append(now)
            given.append([command[n] for n in names])
        reality.step(command, row, min(k / RATE, 1.0))
        if (k + 1) % LOOK == 0:
            now = reality.instant()
    parts = [np.array(part, float) for part in zip(*moments, strict=True)]
    return Log(np.arange(len(moments)) * LOOK / RATE, *parts, np.array(given), reality.cg)
