"""Cases drawn from seeds: the aircraft, what reality has beyond the plain model, the air, and the way in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sysid_node.aircraft.model import Aircraft

#: First words of the seeds of each set; the final one is run once, as it falls.
SETS = {"development": 20260201, "final": 20260501}

#: Aircraft: airspeed (m/s) and altitude (m) at which the model is imported and flown.
#: ``kestrel`` is a UAV of 2 kg, exported as a JSBSim model; the others come with JSBSim: a
#: light aircraft with a propeller, and a jet trainer.
AIRCRAFT = {"kestrel": (16.0, 0.0), "c172p": (52.0, 900.0), "T37": (77.0, 900.0)}

KINDS = {"none": 0.15, "slow servo": 0.15, "one": 0.4, "two": 0.18, "unlisted": 0.12}
TURBULENCE = {"none": 0.5, "light": 0.5}
WAYS = {"import": 0.6, "simulated": 0.4}

CONTROLS = ("elevator", "aileron", "rudder")

#: Derivatives of which one is another in reality.
DERIVATIVES = ("CL_alpha", "CD_0", "CY_beta", "Cl_beta", "Cl_p", "Cm_alpha", "Cm_q", "Cn_beta", "Cn_r")

Span = tuple[float, float]
Values = Mapping[str, float]

#: Spans of sizes, in SI. Of ``derivative_error`` a share of the derivative, of ``cg_shift`` a share of the chord.
SERVO: Mapping[str, Span] = {
    "actuator_lag": (0.06, 0.15),
    "command_delay": (0.04, 0.1),
    "actuator_rate_limit": (0.15, 0.4),
    "actuator_backlash": (0.02, 0.05),
    "actuator_bias": (0.03, 0.08),
    "control_effectiveness_loss": (0.35, 0.7),
}
MODEL: Mapping[str, Span] = {
    "derivative_error": (0.3, 0.6),
    "mass_error": (0.12, 0.25),
    "cg_shift": (0.03, 0.07),
}
INSTRUMENT: Mapping[str, tuple[str | tuple[str, ...], Span]] = {
    "imu_bias": (("p", "q", "r"), (0.02, 0.05)),
    "vane_scale": (("alpha", "beta"), (0.2, 0.4)),
    "airspeed_scale": ("error", (0.06, 0.15)),
    "imu_delay": ("delay", (0.03, 0.08)),
    "air_data_lag": ("time_constant", (0.05, 0.15)),
}
_EITHER = ("actuator_bias", "derivative_error", "mass_error", "cg_shift", "imu_bias", "airspeed_scale")

#: On no list: the aileron's linkage also moves the elevator (rad per rad); a rotor that turns the aircraft as a
#: gyroscope (share of the damping in pitch); a gyroscope that cannot show more than a share of the flight's rates.
UNLISTED: Mapping[str, Span] = {"crossfeed": (0.25, 0.6), "rotor": (0.4, 1.0), "saturation": (0.25, 0.5)}


@dataclass(frozen=True)
class Withheld:
    """What reality has beyond the plain model.

    ``effects`` are those of the list, by name and parameter as the diagnosis calls them, a servo's as what is added to
    the model's own. ``unlisted`` are the others, by name.
    """

    effects: Mapping[str, Values] = field(default_factory=dict)
    unlisted: Values = field(default_factory=dict)
    clipped: str = "q"  # the gyroscope that is saturated, where one is

    def servo(self, control: str) -> Values:
        """Sizes of a control's servo effects by the effect's name."""
        return {name: self.effects[name][control] for name in SERVO if control in self.effects.get(name, {})}

    def of_instruments(self) -> Mapping[str, Values]:
        """The listed effects that lie in the instruments."""
        return {name: values for name, values in self.effects.items() if name in INSTRUMENT}


@dataclass(frozen=True)
class Case:
    """What is flown and how the simulator is known."""

    seed: int
    aircraft: str
    kind: str
    turbulence: str
    way: str


def draw(which: str, seed: int) -> Case:
    """A case of a set."""
    random = np.random.default_rng([SETS[which], seed])
    plane = str(random.choice(list(AIRCRAFT)))
    return Case(seed, plane, *(_one(random, table) for table in (KINDS, TURBULENCE, WAYS)))


def _one(random: np.random.Generator, shares: Mapping[str, float]) -> str:
    return str(random.choice(list(shares), p=list(shares.values())))


def draw_withheld(which: str, case: Case, aircraft: Aircraft) -> Withheld:
    """What a case withholds; ``aircraft`` is the imported model, by whose derivatives and chord sizes are scaled."""
    random = np.random.default_rng([SETS[which], case.seed, 1])
    if case.kind == "unlisted":
        name = str(random.choice(list(UNLISTED)))
        return Withheld(unlisted={name: float(random.uniform(*UNLISTED[name]))}, clipped=str(random.choice(["p", "q"])))
    names = {
        "none": [],
        "slow servo": ["actuator_lag"],
        "one": list(random.choice([*SERVO, *MODEL, *INSTRUMENT], 1)),
        "two": list(random.choice([*SERVO, *MODEL, *INSTRUMENT], 2, replace=False)),
    }[case.kind]
    return Withheld({str(name): sized(str(name), aircraft, random) for name in names})


def sized(name: str, aircraft: Aircraft, random: np.random.Generator) -> dict[str, float]:
    """One effect's parameter, drawn from what it has, and its size."""
    if name in INSTRUMENT:
        keys, span = INSTRUMENT[name]
        key = keys if isinstance(keys, str) else str(random.choice(keys))
    elif name in SERVO:
        key, span = str(random.choice(CONTROLS)), SERVO[name]
    else:
        known = [n for n in DERIVATIVES if n in aircraft.derivatives and abs(aircraft.derivatives[n].value) > 1e-6]
        key = {"derivative_error": str(random.choice(known)), "mass_error": "error", "cg_shift": "x"}[name]
        span = MODEL[name]
    value = float(random.uniform(*span)) * (float(random.choice([-1.0, 1.0])) if name in _EITHER else 1.0)
    if name == "derivative_error":
        value *= abs(aircraft.derivatives[key].value)
    if name == "cg_shift":
        value *= aircraft.geometry.cbar
    return {key: value}
