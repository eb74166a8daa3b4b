"""One case flown, in a process of its own: `python -m bench.withheld.plants.plant SET SEED FOLDER`.

Writes ``FOLDER/SEED/`` with the bags ``fitted`` and ``held`` and ``aircraft.yaml``, whose derivatives are drawn from
their tolerances about the true ones; and the label, apart from these, to ``FOLDER/labels/SEED.json``.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.withheld.drawing import SETS, STATED_SERVOS, Case, draw, seconds_of
from bench.withheld.mattering import beyond, inexplicable, moved, noisy, stamped
from bench.withheld.plants.actuators import servo_lag
from bench.withheld.plants.flying import fly
from bench.withheld.plants.instruments import SUITES, Log, readings, record
from bench.withheld.plants.motion import Airframe, DivergedError, Effects, Instant
from bench.withheld.plants.pilot import Pilot
from bench.withheld.plants.rigid import Rigid
from bench.withheld.plants.sizes import SIZES, sized
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.bag.writer import write_streams
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden

Array = NDArray[np.float64]

RATE = 400.0  # Hz
ATTEMPTS = 12
ENOUGH = 3.0  # times the noise by which an effect must move the response, and what tolerances leave of it
_HEIGHT = {"c172p": 300.0, "transport": 1000.0}  # m above the ground, for the turbulence
_LOW = 100.0


class Plant:
    """The airframe of a case, with or without its effects, and all that goes with it."""

    def __init__(self, case: Case, which: str, flown_by: Aircraft | None = None) -> None:
        self.case, self.which = case, which
        self.truth = _aircraft(case.plant)
        self.flown_by = flown_by or self.truth  # a model may be put in the truth's place
        self.effects = _in_units(case.effects, self.truth)

    def airframe(self, effects: Effects) -> Airframe:
        """Raises DivergedError where it cannot be trimmed."""
        if self.case.plant == "c172p":
            from bench.withheld.plants.cessna import Cessna  # noqa: PLC0415  # JSBSim, where it is needed

            return Cessna(self.truth, effects, RATE)
        return Rigid(self.flown_by, effects, RATE)

    def fly(self, effects: Effects, flight: int) -> Log:
        """The flight that is fitted (0), held out (1), or a further one like it in other air. Raises DivergedError."""
        airframe = self.airframe(effects)
        random = np.random.default_rng([SETS[self.which], self.case.seed, 1 + flight])
        air, own = random.spawn(2)
        plan = parse_manoeuvre(
            self.case.manoeuvres[min(flight, 1)], _with_thrust(self.truth), RATE, seconds_of(self.case.plant)
        )
        planned = {n: plan.deflections[n] for n in airframe.controls}
        planned["thrust"] = plan.deflections["throttle"] * _thrust_unit(self.truth)
        highest = _thrust_unit(self.truth)

        def pilot(start: Instant) -> Pilot:
            return Pilot(self.truth, airframe.trim, start, self.case.bandwidth, own, highest)

        limits = {n: c.limit or 0.5 for n, c in self.truth.controls.items()}
        gusts = self._gusts(plan.time.size, air)
        return fly(airframe, effects, pilot, planned, gusts, limits, RATE, self.case.servo)

    def _gusts(self, samples: int, random: np.random.Generator) -> Array:
        intensity = INTENSITIES[self.case.turbulence]
        if not intensity:
            return np.zeros((samples, 6))
        dryden = Dryden.at(_HEIGHT.get(self.case.plant, _LOW), self.truth.geometry.b)
        return intensity * dryden.realisation(samples, RATE, self.truth.reference.airspeed, random)

    def seen(self, log: Log, effects: Effects) -> Array:
        """Noiseless readings (N, 12) by their stamps."""
        return stamped(log, readings(log, self.truth, effects), effects)


def _aircraft(name: str) -> Aircraft:
    if name == "c172p":
        from bench.withheld.plants.cessna import aircraft  # noqa: PLC0415

        return aircraft()
    return sized(name) if name in SIZES else load_aircraft(name)


def _with_thrust(aircraft: Aircraft) -> Aircraft:
    """With a throttle of 0 to 1, which is what manoeuvres are drawn for."""
    throttle = aircraft.throttle
    return replace(aircraft, throttle=throttle and replace(throttle, max_thrust=_thrust_unit(aircraft)))


def _thrust_unit(aircraft: Aircraft) -> float:
    return (aircraft.throttle and aircraft.throttle.max_thrust) or 3000.0


def _in_units(effects: Mapping[str, Mapping[str, float]], aircraft: Aircraft) -> dict[str, dict[str, float]]:
    """Errors of derivatives are drawn in tolerances, towards the derivative's own sign: it must still fly."""
    known = {name: dict(values) for name, values in effects.items()}
    for name, size in known.get("derivative_error", {}).items():
        derivative = aircraft.derivatives[name]
        known["derivative_error"][name] = float(np.copysign(size * (derivative.tolerance or 0.0), derivative.value))
    return known


def handed_over(plant: Plant) -> tuple[Aircraft, np.random.Generator]:
    """The aircraft file of a case, and what its recording's noise is drawn from then."""
    random = np.random.default_rng([SETS[plant.which], plant.case.seed, 99])
    belief = believed(plant.truth, random)
    return (with_servos(belief, plant.case.servo) if plant.which in STATED_SERVOS else belief), random


def with_servos(aircraft: Aircraft, servo: float) -> Aircraft:
    """The file with the lag of servos of so many Hz, as data sheets have it: within a fifth (1 sigma)."""
    lag = servo_lag(servo)
    stated = {"actuator_lag": {name: UncertainValue(lag, 0.2 * lag) for name in aircraft.controls}}
    return replace(aircraft, effects={**aircraft.effects, **stated})


def believed(aircraft: Aircraft, random: np.random.Generator) -> Aircraft:
    """The aircraft file that is handed over: derivatives off by their tolerances, no drag below zero."""
    wrong = {}
    for name, derivative in aircraft.derivatives.items():
        off = float(np.clip(random.standard_normal(), -2.5, 2.5)) * (derivative.tolerance or 0.0)
        value = derivative.value + off
        wrong[name] = replace(derivative, value=abs(value) if name == "CD_0" else value)
    return replace(aircraft, derivatives=wrong, source="derivatives as computed, each off by about its tolerance")


def flown(which: str, seed: int) -> tuple[Plant, list[Log], dict[str, float]]:
    """The first attempt whose effects matter, each by itself: plant, both flights, how far each moves them."""
    for attempt in range(ATTEMPTS):
        plant = Plant(draw(which, seed, attempt), which)
        try:
            sizes = measured(plant)
            if all(size >= ENOUGH for size in sizes.values()):
                return plant, [plant.fly(plant.effects, i) for i in range(2)], sizes
        except DivergedError:
            continue
    raise DivergedError(f"case {seed}: no attempt of {ATTEMPTS} both flies and matters")


def measured(plant: Plant) -> dict[str, float]:
    """How far each effect moves the response, and what is left beyond the tolerances, in noise floors."""
    if not plant.effects:
        return {}
    still = replace(plant.case, turbulence="none")
    calm, belief = Plant(still, plant.which), handed_over(plant)[0]
    log = calm.fly({}, 0)
    without = calm.seen(log, {})
    bare = inexplicable(log, without, belief, {}, RATE)
    rough = noisy(without, plant.truth, RATE, np.random.default_rng(0))
    noise = inexplicable(log, rough, belief, {}, RATE) - bare
    sizes = {}
    for name, values in plant.effects.items():
        alone = {name: values}
        log = calm.fly(alone, 0)
        late = log if _as_command(alone) is alone else calm.fly(_as_command(alone), 0)
        apart = moved(calm.seen(late, alone), without, plant.truth)
        after = inexplicable(log, calm.seen(log, alone), belief, alone, RATE)
        sizes |= {f"{name}, response": apart, f"{name}, beyond tolerances": beyond(after, bare, noise)}
    return sizes


def _as_command(effects: Effects) -> Effects:
    """A stamp that is late moves no response; it looks like the command that is early, so it is measured as one."""
    late = effects.get("actuator_stamp_delay")
    return {"command_delay": late} if late else effects


def label(plant: Plant, sizes: Mapping[str, float]) -> dict[str, object]:
    """What the scorer needs to know."""
    known = {k: v for k, v in asdict(plant.case).items() if k != "effects"}
    return {**known, "effects": plant.effects, "moves": dict(sizes), "servo_lag": servo_lag(plant.case.servo)}


def write(which: str, seed: int, folder: Path) -> None:
    """Flies and writes a case."""
    plant, logs, sizes = flown(which, seed)
    belief, random = handed_over(plant)
    out = folder / str(seed)
    out.mkdir(parents=True, exist_ok=True)
    (out / "aircraft.yaml").write_text(dump_aircraft(belief), encoding="utf-8")
    for name, log in zip(("fitted", "held"), logs, strict=True):
        case, seen = plant.case, readings(log, plant.truth, plant.effects)
        streams = record(log, seen, plant.truth, plant.effects, SUITES[case.suite], case.noise, random)
        write_streams(out / name, streams)
    labels = folder / "labels"
    labels.mkdir(exist_ok=True)
    (labels / f"{seed}.json").write_text(json.dumps(label(plant, sizes), indent=1), encoding="utf-8")


if __name__ == "__main__":
    write(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
