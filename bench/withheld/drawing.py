"""Cases drawn at random: plant, aircraft, effect and size, manoeuvres, turbulence, instruments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bench.withheld.plants.instruments import USUAL
from bench.withheld.plants.sizes import SIZES, chord, slower

SETS = {"development": 20260101, "final": 20260401, "sizes_development": 20261101, "sizes": 20261125,
        "servos": 20261126}  # fmt: skip
#: Sets whose aircraft files state the plants' servos.
STATED_SERVOS = ("servos",)
PLANTS = {"cdfp": 0.25, "cdrw": 0.25, "kestrel": 0.25, "c172p": 0.25}  # the last flies in JSBSim
#: Plants of the two sets of other sizes, and the instruments that each may have.
SIZED = dict.fromkeys(SIZES, 1.0 / len(SIZES))
SUITES_OF = {"foamie": ("fast", "small"), "transport": ("fifty", "slow", "ten")}
FOREIGN = "c172p"  # whose tables no aircraft file holds
KINDS = {"none": 0.2, "one": 0.5, "two": 0.15, "unlisted": 0.15}
TURBULENCE = {"none": 0.4, "light": 0.4, "moderate": 0.2}

SECONDS = 44.0
CONTROLS = ("elevator", "aileron", "rudder")

Span = tuple[float, float]
Values = dict[str, float]


@dataclass(frozen=True)
class Size:
    """Spans from which the parameters of an effect are drawn. ``either``: sign at random. ``pick``: only one of them,
    the others left alone. ``metres``: as a share of the chord. ``cessna``: whether the JSBSim plant can show it."""

    spans: Mapping[str, Span]
    either: tuple[str, ...] = ()
    pick: bool = False
    metres: bool = False
    cessna: bool = True


def _controls(span: Span, *, either: bool = False) -> Size:
    return Size(dict.fromkeys(CONTROLS, span), CONTROLS if either else (), pick=True)


_ONSET: Span = (12.0, 30.0)

#: Effects of the simulator's list that forces or trajectories can show. Not here: steady wind and gusts, which the
#: vanes measure; noise; ground effect, which needs the ground.
LISTED: Mapping[str, Size] = {
    "command_delay": Size({"delay": (0.03, 0.1)}),
    "actuator_lag": Size({"time_constant": (0.04, 0.15)}),
    "actuator_rate_limit": Size({"rate": (0.3, 0.9)}),
    "actuator_backlash": _controls((0.02, 0.05)),
    "actuator_bias": _controls((0.03, 0.08), either=True),
    "stuck_surface": Size({"rudder_position": (0.02, 0.06), "onset": _ONSET}, ("rudder_position",)),
    "control_effectiveness_loss": _controls((0.35, 0.7)),
    "derivative_error": Size(
        dict.fromkeys(("CL_alpha", "Cm_alpha", "Cm_q", "Cl_p", "Cl_beta", "Cn_beta", "Cn_r"), (4.0, 7.0)), pick=True
    ),
    "nonlinear_pitching_moment": Size({"quadratic": (1.0, 3.0)}, ("quadratic",)),
    "stall_separation": Size({"depth": (0.6, 1.0), "alpha_star": (0.12, 0.22)}, cessna=False),
    "unsteady_aerodynamics": Size({"CL_alphadot": (1.0, 4.0), "Cm_alphadot": (-8.0, -2.0)}, cessna=False),
    "lateral_alpha_coupling": Size(
        {"Cl_beta_alpha": (0.5, 1.5), "Cn_beta_alpha": (0.2, 0.8)}, ("Cl_beta_alpha", "Cn_beta_alpha")
    ),
    "control_nonlinearity": _controls((10.0, 30.0)),
    "drag_rise": Size({"parabola": (0.15, 0.5)}),
    "lateral_asymmetry": Size({"Cl_0": (0.004, 0.02), "Cn_0": (0.001, 0.006)}, ("Cl_0", "Cn_0")),
    "thrust_scale": Size({"error": (0.2, 0.5)}, ("error",)),
    "thrust_line_offset": Size({"arm": (0.1, 0.3)}, ("arm",), metres=True, cessna=False),
    "thrust_yaw": Size({"arm": (0.02, 0.08), "torque_arm": (0.02, 0.06)}, ("arm", "torque_arm"), cessna=False),
    "propwash": Size({"gain": (2.0, 8.0)}, cessna=False),
    "motor_lag": Size({"time_constant": (0.3, 1.0)}, cessna=False),
    "mass_error": Size({"error": (0.12, 0.25)}, ("error",)),
    "inertia_error": Size(dict.fromkeys(("Ixx", "Iyy", "Izz"), (0.25, 0.6)), pick=True),
    "cg_shift": Size({"x": (0.03, 0.07)}, ("x",), metres=True),
    "structural_mode": Size({"gain": (0.3, 0.8), "slope": (0.5, 2.0), "frequency": (2.5, 6.0)}, cessna=False),
    "imu_bias": Size(dict.fromkeys("pqr", (0.02, 0.05)) | dict.fromkeys(("ax", "ay", "az"), (0.25, 0.6)),
                     (*"pqr", "ax", "ay", "az"), pick=True),
    "imu_scale": Size(dict.fromkeys((*"pqr", "az"), (0.08, 0.2)), (*"pqr", "az"), pick=True),
    "imu_misalignment": Size(dict.fromkeys(("roll", "pitch", "yaw"), (0.05, 0.12)), ("roll", "pitch", "yaw"),
                             pick=True),
    "imu_lever_arm": Size({"x": (0.4, 1.0), "z": (0.2, 0.5)}, ("x", "z"), metres=True),
    "airspeed_scale": Size({"error": (0.06, 0.15)}, ("error",)),
    "vane_bias": Size(dict.fromkeys(("alpha", "beta"), (0.025, 0.06)), ("alpha", "beta"), pick=True),
    "vane_scale": Size(dict.fromkeys(("alpha", "beta"), (0.2, 0.4)), pick=True),
    "vane_lever_arm": Size({"x": (0.8, 2.0)}, ("x",), metres=True),
    "air_data_lag": Size({"time_constant": (0.05, 0.15)}),
    "imu_delay": Size({"delay": (0.03, 0.08)}),
    "air_data_delay": Size({"delay": (0.04, 0.1)}),
    "actuator_stamp_delay": Size({"delay": (0.03, 0.08)}),
}  # fmt: skip

#: Effects that are on nobody's list.
UNLISTED: Mapping[str, Size] = {
    "slosh": Size({"share": (0.08, 0.2), "frequency": (0.6, 1.6), "damping": (0.03, 0.1), "height": (0.1, 0.4)},
                  ("height",), cessna=False),
    "wing_damage": Size({"share": (0.06, 0.15), "onset": _ONSET}),
    "saturation": Size(dict.fromkeys((*"pqr", "alpha", "beta", "az"), (0.25, 0.5)), pick=True),
    "ice": Size({"lift_loss": (0.2, 0.4), "drag": (0.01, 0.03), "seconds": (25.0, 60.0)}),
}  # fmt: skip

#: What every flight of the JSBSim plant has beside the derivatives that its aircraft file holds.
INHERENT = ("unsteady_aerodynamics", "propwash", "thrust_yaw", "drag_rise", "nonlinear_pitching_moment",
            "lateral_alpha_coupling", "stall_separation", "control_nonlinearity")  # fmt: skip

#: Where that plant's load, one person on the left, puts the centre of gravity (m from the plane of symmetry, to the
#: right). Lift rolls the aircraft by this arm, and no derivative of the file tells of a roll with the angle of attack.
LOADED_ASIDE = -0.034


@dataclass(frozen=True)
class Case:
    """What is flown, but for the derivatives' errors."""

    seed: int
    plant: str
    kind: str
    effects: dict[str, Values]
    manoeuvres: tuple[tuple[str, ...], tuple[str, ...]]  # of the flight that is fitted and of the one held out
    programme: str
    turbulence: str
    suite: str
    noise: float  # times the aircraft file's
    servo: float  # Hz
    bandwidth: float  # of the autopilot, rad/s


def draw(which: str, seed: int, attempt: int = 0) -> Case:
    """A case of a set. A later attempt draws the sizes anew, all else alike."""
    random = np.random.default_rng([SETS[which], seed])
    plants = SIZED if which.startswith("sizes") else PLANTS
    plant, kind, turbulence = (_one(random, table) for table in (plants, KINDS, TURBULENCE))
    names = _names(random, kind, plant)
    programme = str(random.choice(["steps", "doublets", "mixed", "multisine"], p=[0.4, 0.2, 0.25, 0.15]))
    manoeuvres = tuple(programme_of(programme, plant, random) for _ in range(2))
    suite, noise = str(random.choice(SUITES_OF.get(plant, USUAL))), float(random.uniform(0.7, 1.3))
    servo, bandwidth = float(random.uniform(25.0, 40.0)), float(random.uniform(0.8, 1.8)) / _slowness(plant)
    sizes = np.random.default_rng([SETS[which], seed, attempt])
    effects = {name: _sized(name, plant, sizes, min(1.0 + 0.15 * attempt, 2.0)) for name in names}
    return Case(seed, plant, kind, effects, manoeuvres, programme, turbulence, suite, noise, servo, bandwidth)  # type: ignore[arg-type]


def _one(random: np.random.Generator, shares: Mapping[str, float]) -> str:
    return str(random.choice(list(shares), p=list(shares.values())))


def _names(random: np.random.Generator, kind: str, plant: str) -> list[str]:
    table = UNLISTED if kind == "unlisted" else LISTED
    able = [n for n, size in table.items() if size.cessna or plant != "c172p"]
    count = {"none": 0, "one": 1, "two": 2, "unlisted": 1}[kind]
    return [str(n) for n in random.choice(able, count, replace=False)]


def _sized(name: str, plant: str, random: np.random.Generator, more: float) -> Values:
    """Parameters of an effect; lengths and what scales with the aircraft in its own units, by the plant."""
    size = {**LISTED, **UNLISTED}[name]
    keys = [str(random.choice(list(size.spans)))] if size.pick else list(size.spans)
    values = {}
    for key in keys:
        low, high = size.spans[key]
        value = float(random.uniform(low, high)) * (more if key not in ("onset", "alpha_star", "frequency") else 1.0)
        values[key] = value * (float(random.choice([-1.0, 1.0])) if key in size.either else 1.0)
    if size.metres:
        values = {key: value * _length(plant) for key, value in values.items()}
    powers = dict.fromkeys("pqr", -1) if name == "imu_bias" else _POWER_OF_TIME
    values = {key: value * _slowness(plant) ** powers.get(key, 0) for key, value in values.items()}
    if name == "control_effectiveness_loss":
        values["onset"] = float(random.choice([-10.0, random.uniform(*_ONSET) * _spread(plant)]))
        values = {k: min(v, 0.85) if k != "onset" else v for k, v in values.items()}
    if name == "thrust_scale":  # an engine that gives next to nothing is no scale error
        values = {k: float(np.clip(v, -0.6, 0.8)) for k, v in values.items()}
    if name == "actuator_rate_limit":
        values["rate"] /= more**2
    return {**values, "rudder": 1.0} if name == "stuck_surface" else values


#: Lengths by which lever arms are scaled, m: about the mean chord, not more than half a metre for a delta.
CHORDS = {"cdfp": 0.4, "cdrw": 0.4, "kestrel": 0.25, "c172p": 1.5}

#: Power of time in the unit of a parameter: a size whose motions are slower has longer delays and smaller rates.
_POWER_OF_TIME = {"delay": 1, "time_constant": 1, "seconds": 1, "rate": -1, "frequency": -1}

_AMPLITUDE = {"elevator": 0.06, "aileron": 0.06, "rudder": 0.1}


def _length(plant: str) -> float:
    return chord(plant) if plant in SIZES else CHORDS[plant]


def _slowness(plant: str) -> float:
    """How many times as slow as those of a small aircraft the motions of a size are."""
    return slower(plant) if plant in SIZES else 1.0


def _spread(plant: str) -> float:
    """How many times as long as usual the flights are: in a large aircraft the manoeuvres need it."""
    return max(_slowness(plant) / 1.6, 1.0)


def seconds_of(plant: str) -> float:
    """Length of a flight, s."""
    return SECONDS * _spread(plant)


def programme_of(programme: str, plant: str, random: np.random.Generator) -> tuple[str, ...]:
    """Specs of one flight's manoeuvres, amplitudes drawn; a throttle doublet goes with all of them."""
    slow, spread = 1.6 if plant == FOREIGN else _slowness(plant), _spread(plant)
    size = {c: a * float(random.uniform(0.8, 1.3)) for c, a in _AMPLITUDE.items()}
    start = spread * random.uniform(9, 14)
    throttle = f"doublet:throttle:amplitude=0.08:width={2 * spread:g}:start={start:.2f}:every={16 * spread:g}:repeat=2"
    if programme == "multisine":
        amplitudes = ",".join(f"{1.5 * a:.4g}" for a in size.values())
        band = f"length={40 * spread:g}:low={0.1 / spread:g}:high={2.5 / slow:.2f}:start=1.5"
        return f"multisine:{','.join(size)}:amplitude={amplitudes}:{band}", throttle
    kinds = {
        "steps": ("3211", "3211", "3211"),
        "doublets": ("doublet", "doublet", "doublet"),
        "mixed": ("3211", "doublet", "3211"),
    }[programme]
    specs = []
    for (control, amplitude), kind, start in zip(size.items(), kinds, (1.0, 3.8, 6.0), strict=True):
        width = slow * float(random.uniform(0.22, 0.35)) * (1.5 if kind == "doublet" else 1.0)
        sign = int(random.choice([-1, 1]))
        specs.append(
            f"{kind}:{control}:amplitude={sign * amplitude:.4g}:width={width:.3f}"
            f":start={start * spread}:every={8 * spread:g}:repeat=5"
        )
    return (*specs, throttle)
