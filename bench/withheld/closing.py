"""How much of the gap a diagnosis closes, beside what the true effect closes.

Measured in the plant: the held-out flight again, with the same gusts and without noise, once as it was, once with the
aircraft file that was handed over, once with the corrected file and the effects found, once with the true effect in
their place. A foreign plant flies no other aircraft's file: there the simulator flies the same three beside the
held-out record.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.withheld.drawing import FOREIGN, Case
from bench.withheld.plants.motion import DivergedError, Effects
from bench.withheld.plants.plant import RATE, Plant
from bench.withheld.predicting import everywhere, vector
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE, load_gap_flights
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.validation.simulation_error import simulation_gap
from sysid_node.sim import Simulator

Array = NDArray[np.float64]

#: Windows, their means left out, in which responses are compared: drift from trim to trim is no dynamics.
WINDOW_S = 4.0

#: Times by which a response is later than commands, or stamps of commands make it seem earlier.
_LATE = (
    ("command_delay", "delay", -1.0),
    ("actuator_lag", "time_constant", -1.0),
    ("actuator_stamp_delay", "delay", 1.0),
)

_READ = (0, 1, 2, 3, 4, 5, 9, 10, 11)  # IMU and air data, without the attitude


def closed(label: Mapping[str, Any], which: str, case: Path) -> dict[str, float] | None:
    """Errors as shares of the motion: ``before``, ``after``, and with the corrected file and the ``true_effect``.

    None where one cannot be flown. Kept beside the case.
    """
    kept = case / "closed.json"
    if kept.exists():
        known: dict[str, float] = json.loads(kept.read_text(encoding="utf-8"))
        return known or None
    errors = _beside_record(label, case) if label["plant"] == FOREIGN else _errors(label, which, case)
    kept.write_text(json.dumps(errors), encoding="utf-8")
    return errors or None


def _errors(label: Mapping[str, Any], which: str, case: Path) -> dict[str, float]:
    fields = {k: v for k, v in label.items() if k in Case.__dataclass_fields__}
    plant = Plant(Case(**fields), which)
    truth = _flown(plant, plant.truth, label["effects"])
    found = effects_of((case / "out" / "effects.txt").read_text(encoding="utf-8"))
    effects = beside_servos(found, label["servo_lag"])
    try:
        corrected = load_aircraft(str(case / "out" / "corrected.yaml"))
        before = _flown(plant, load_aircraft(str(case / "aircraft.yaml")), {})
        after, best = (_flown(plant, corrected, one) for one in (effects, label["effects"]))
    except DivergedError:
        return {}
    flights = {"before": before, "after": after, "true_effect": best}
    return {name: _apart(flight, truth) for name, flight in flights.items()}


def beside_servos(effects: Effects, servo_lag: float) -> Effects:
    """Effects found, as a plant flies them whose servos are ``servo_lag`` (s) late of themselves.

    Nothing that is handed over knows of the servos, so that a time that is found holds theirs, and would count twice.
    """
    for name, key, sign in _LATE:
        if name in effects:
            sizes = effects[name]
            times = [key] if key in sizes else [control for control in sizes if control != "onset"]
            late = {time: max(sizes[time] + sign * servo_lag, 0.0) for time in times}
            return {**effects, name: {**sizes, **late}}
    return effects


def _beside_record(label: Mapping[str, Any], case: Path) -> dict[str, float]:
    """The simulator's errors on the held-out record, by the diagnosis' own rule, noise and all."""
    aircraft, corrected = (load_aircraft(str(case / name)) for name in ("aircraft.yaml", "out/corrected.yaml"))
    simulator = Simulator(aircraft, ANALYSIS_RATE)
    [held] = load_gap_flights(case / "held", aircraft, None, "flu")
    model = residual_model_of(simulator, held)
    found = effects_of((case / "out" / "effects.txt").read_text(encoding="utf-8"))
    points = (vector(simulator, corrected, effects) for effects in (found, label["effects"]))
    gap = simulation_gap(*(everywhere((model,), point) for point in points))
    return {"before": gap.before, "after": gap.tolerances, "true_effect": gap.after} if gap else {}


def _flown(plant: Plant, aircraft: Aircraft, effects: Effects) -> Array:
    """Readings (N, 12) of the held-out flight, were the aircraft this one; the autopilot stays as it is."""
    other = Plant(plant.case, plant.which, replace(aircraft, controls=plant.truth.controls))
    return other.seen(other.fly(effects, 1), effects)


def _apart(model: Array, truth: Array) -> float:
    """Root-mean-square difference over the motion's own, mean over the readings."""
    size = round(WINDOW_S * RATE)
    count = len(truth) // size

    def windows(x: Array) -> Array:
        parts = x[: count * size, _READ].reshape(count, size, len(_READ))
        return np.asarray(parts - parts.mean(axis=1, keepdims=True))

    off = np.mean((windows(model) - windows(truth)) ** 2, axis=(0, 1))
    return float(np.sqrt(np.mean(off / np.mean(windows(truth) ** 2, axis=(0, 1)))))


def effects_of(text: str) -> dict[str, dict[str, float]]:
    """Of the lines ``--effect name:key=value:...`` of effects.txt, in the plant's words."""
    found: dict[str, dict[str, float]] = {}
    for line in text.splitlines():
        name, *pairs = line.removeprefix("--effect ").split(":")
        values = {key: float(value) for key, value in (pair.split("=") for pair in pairs)}
        found[name] = values
    return found
