"""Flights of a reality as bags, with an autopilot, real instruments and turbulence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.withheld.jsbsim.drawing import Withheld
from bench.withheld.jsbsim.reality import Reality
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
#: Of the autopilot's airspeed, s. A throttle that followed each reading's noise would keep an engine that gains speed
#: more slowly than it loses it far below its steady thrust.
SMOOTHING = 1.0


@dataclass(frozen=True)
class World:
    """What flies: the user's model, its aircraft file, and what reality has beyond it."""

    survey: ModelSurvey
    aircraft: Aircraft
    withheld: Withheld


#: The two flights of reality, and of the simulator: the first is fitted, the second held out.
MANOEUVRES = ("3211:repeat=2", "multisine")


def write_flights(folder: Path, names: Sequence[str], world: World, turbulence: str, noise: float, seed: int) -> None:
    """Two flights as bags of these names, with ``noise`` times the instruments'. Raises DivergedError."""
    effects = {**world.withheld.of_instruments(), "saturation": _clipped(world.withheld)}
    for place, name in enumerate(names):
        random = np.random.default_rng([seed, place])
        log = flown(world, turbulence, MANOEUVRES[place], random)
        seen = readings(log, world.aircraft, effects)
        streams = record(log, seen, world.aircraft, effects, SUITES["research"], noise, random)
        write_streams(folder / name, streams)


def _clipped(withheld: Withheld) -> dict[str, float]:
    share = withheld.unlisted.get("saturation")
    return {withheld.clipped: share} if share else {}


def flown(world: World, turbulence: str, manoeuvre: str, random: np.random.Generator) -> Log:
    """One flight at ``RATE``. Raises DivergedError."""
    aircraft = world.aircraft
    reality = Reality(world.survey, aircraft, world.withheld, RATE)
    air, own = random.spawn(2)
    plan = parse_manoeuvre(manoeuvre, aircraft, RATE, SECONDS)
    planned = {name: plan.deflections[name] for name in reality.controls}
    full = (aircraft.throttle and aircraft.throttle.max_thrust) or 1.0
    planned["thrust"] = plan.deflections["throttle"] * full

    now = reality.start()
    hands = Pilot(aircraft, reality.trim, now, 1.0, own, full, SMOOTHING)
    gusts = np.zeros((plan.time.size, 6))
    if INTENSITIES[turbulence]:
        dryden = Dryden.at(HEIGHT, aircraft.geometry.b)
        gusts = INTENSITIES[turbulence] * dryden.realisation(len(gusts), RATE, aircraft.reference.airspeed, air)
    names = (*reality.controls, "thrust")
    moments, given, command = [], [], dict(reality.trim)
    for k, row in enumerate(gusts.tolist()):
        if k % round(RATE / PILOT_RATE) == 0:
            command = hands.command({n: float(planned[n][k]) for n in names}, now)
            command["thrust"] = min(max(command["thrust"], 0.0), full)
        reality.step(command, row, min(k / RATE, 1.0))
        # JSBSim moves the body by the loads before, then computes those of this command: both belong to this instant
        if k % LOOK == 0:
            now = reality.instant()
            moments.append(now)
            given.append([command[n] for n in names])
    parts = [np.array(part, float) for part in zip(*moments, strict=True)]
    return Log(np.arange(len(moments)) * LOOK / RATE, *parts, np.array(given), reality.cg)
