"""Cases of spike and recovery drawn at random: flight, effect, size. Sizes are beyond what three tolerances excuse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft

from .records import FLIGHTS, Flight, belief, part, rate_of

#: Seeds of the sets; on the final one nothing is tuned.
SETS = {"development": 20261123, "final": 20261201}

#: How often each flight is drawn.
_WEIGHTS = {"cessna_de": 2, "cessna_da": 1, "cessna_dr": 1, "cessna_dadr": 1, "hfb320": 2, "twin_otter": 2,
            "attas": 2, "thor": 2}  # fmt: skip

_Span = tuple[float, float]


@dataclass(frozen=True)
class Case:
    """What is put into which flight; nothing where ``effect`` is empty."""

    seed: int
    flight: str
    effect: str
    values: Mapping[str, float]


def draw(folder: Path, which: str, seed: int) -> Case:
    """A case of a set: the first are the flights as they are, the others have one effect each."""
    names = list(FLIGHTS)
    if seed < len(names):
        return Case(seed, names[seed], "", {})
    random = np.random.default_rng([SETS[which], seed])
    weights = np.array([_WEIGHTS[name] for name in names], float)
    name = str(random.choice(names, p=weights / weights.sum()))
    effects = _effects_of(folder, name)
    effect = str(random.choice(list(effects)))
    return Case(seed, name, effect, _sized(effects[effect], random))


@dataclass(frozen=True)
class _Size:
    """Spans from which parameters are drawn, of which one is picked; ``either``: the sign at random."""

    spans: Mapping[str, _Span]
    either: bool = False
    always: Mapping[str, float] | None = None


def _sized(size: _Size, random: np.random.Generator) -> dict[str, float]:
    name = str(random.choice(list(size.spans)))
    value = float(random.uniform(*size.spans[name]))
    if size.either and random.random() < 0.5:
        value = -value
    return {name: value} | dict(size.always or {})


@cache
def _effects_of(folder: Path, name: str) -> Mapping[str, _Size]:
    """The effects that can be put into a flight, without those that undo what its record holds."""
    flight = FLIGHTS[name]
    found = _effects(folder, flight, belief(folder, flight))
    return {effect: size for effect, size in found if effect not in flight.cancelled}


def _effects(folder: Path, flight: Flight, aircraft: Aircraft) -> Iterator[tuple[str, _Size]]:
    """What can be put into a flight, with sizes in the aircraft's own measure."""
    rate, chord = rate_of(part(folder, flight, flight.fitted[0])), aircraft.geometry.cbar
    lateral = set(flight.moved) & {"aileron", "rudder"}
    turning = [axis for axis, there in (("q", "elevator" in flight.moved), ("p", lateral), ("r", lateral)) if there]
    time = (max(0.04, 1.5 / rate), max(0.12, 3.5 / rate))
    for name in ("imu_delay", "air_data_delay", "actuator_stamp_delay", "command_delay"):
        yield name, _Size({"delay": time})
    yield "actuator_lag", _Size({"time_constant": time})
    gyro, accel = flight.bias["gyro"], flight.bias["accel"]
    yield (
        "imu_bias",
        _Size(dict.fromkeys(turning, (6.0 * gyro, 15.0 * gyro)) | {"az": (6.0 * accel, 15.0 * accel)}, True),
    )
    yield "imu_scale", _Size(dict.fromkeys(turning, (0.15, 0.3)), True)
    yield "airspeed_scale", _Size({"error": (0.12, 0.25)}, True)
    angles = [*(["alpha"] if "elevator" in flight.moved else []), *(["beta"] if lateral else [])]
    vane = flight.bias["alpha"]
    yield "vane_bias", _Size(dict.fromkeys(angles, (6.0 * vane, 10.0 * vane)), True)
    yield "vane_scale", _Size(dict.fromkeys(angles, (0.2, 0.4)))
    yield "vane_lever_arm", _Size({"x": (2.0 * chord, 5.0 * chord)})
    yield "imu_lever_arm", _Size({"x": (0.5 * chord, 1.5 * chord)}, True)
    turned = {"pitch": (0.05, 0.12)} if flight.in_plane else dict.fromkeys(("roll", "pitch", "yaw"), (0.05, 0.12))
    yield "imu_misalignment", _Size(turned, True)
    yield "control_effectiveness_loss", _Size(dict.fromkeys(flight.moved, (0.4, 0.65)), always={"onset": -10.0})
    if flight.still:
        yield "stuck_surface", _Size(dict.fromkeys(flight.still, (0.03, 0.06)), True)
    yield "mass_error", _Size({"error": (0.2, 0.35)})
    moments = {"q": "Iyy", "p": "Ixx", "r": "Izz"}
    yield "inertia_error", _Size({moments[w]: (0.4, 0.7) for w in turning})
    strong = {"q": ("CL_alpha", "Cm_alpha", "Cm_q"), "p": ("Cl_p",), "r": ("Cn_beta", "Cn_r")}
    own = [n for w in turning for n in strong[w] if n in aircraft.derivatives]
    sigmas = {n: aircraft.derivatives[n].tolerance or 0.0 for n in own}
    yield "derivative_error", _Size({n: (4.0 * s, 7.0 * s) for n, s in sigmas.items()}, True)
    if "elevator" in flight.moved:
        yield "cg_shift", _Size({"x": (0.08 * chord, 0.15 * chord)}, True)
