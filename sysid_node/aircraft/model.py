"""The contents of an aircraft file: geometry, mass, controls, derivatives. SI units, radians, body axes FRD."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from types import MappingProxyType

from sysid_node.aircraft.default_tolerances import DEFAULT_NOISE_BIAS, UNKNOWN_SERVO_LAG, tolerances
from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.aircraft.names import model_structure

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Inertia:
    """Moments of inertia about the centre of gravity, body axes, kg m^2. NaN = not known."""

    Ixx: float
    Iyy: float
    Izz: float
    Ixz: float = 0.0


@dataclass(frozen=True)
class Geometry:
    """Reference area (m^2), span (m) and mean aerodynamic chord (m)."""

    S: float
    b: float
    cbar: float


#: Least and greatest airspeed of an aircraft, m/s.
AIRSPEEDS = (0.1, 10_000.0)


@dataclass(frozen=True)
class ReferenceCondition:
    """The flight condition for which the derivatives hold: true airspeed (m/s), air density (kg/m^3)."""

    airspeed: float
    air_density: float


@dataclass(frozen=True)
class Control:
    """One aerodynamic control, a linear map from actuator joints: value = offset + sum scale_j joint_j."""

    name: str
    symbol: str  # "de": the regressor's name in Cm_de
    joints: Mapping[str, float]  # joint name -> scale
    offset: float = 0.0  # rad
    limit: float | None = None  # rad, both ways
    full_deflection: float | None = None  # rad at the autopilot's full command, for logs of autopilots


@dataclass(frozen=True)
class Throttle:
    """Thrust = max_thrust * joint (0..1), or the joint's value itself where it is in newtons."""

    joint: str
    max_thrust: float | None = None  # N at 1.0; None: the joint is thrust in N
    inclination: float = 0.0  # rad, thrust line above the body x axis
    arm: float = 0.0  # m: pitching moment about the CG per newton of thrust, nose up positive


@dataclass(frozen=True)
class Derivative:
    """A derivative's value (per radian, or per unit of its regressor) and its 1-sigma tolerance."""

    value: float
    tolerance: float | None = None

    @property
    def uncertainty(self) -> float:
        """The tolerance; a fifth of the value where the file states none."""
        return 0.2 * abs(self.value) if self.tolerance is None else self.tolerance


@dataclass(frozen=True)
class Sensors:
    """Positions of the sensors relative to the CG, body axes FRD, m."""

    imu: Vector3 = (0.0, 0.0, 0.0)
    air_data: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class UncertainValue:
    """A number and its 1-sigma tolerance; None where the file states none."""

    value: float
    tolerance: float | None = None


#: The topics whose stamps may be late, and the effect by which the simulator models this.
DELAY_EFFECTS: Mapping[str, str] = MappingProxyType(
    {"imu": "imu_delay", "air_data": "air_data_delay", "actuators": "actuator_stamp_delay"}
)


@dataclass(frozen=True)
class LookupTable:
    """A lookup table that is added to a coefficient: linear between its points, held beyond its ends.

    ``over`` names one or two of alpha, beta (rad), V (true airspeed, m/s), Mach, p, q, r (non-dimensional, as in the
    derivatives), the controls' symbols (rad) and throttle (0..1, with the motor's lag). ``points`` are the increasing
    points of each. ``values`` are as many numbers as there are points, or for two variables a row for each point of
    the first.
    """

    coefficient: str
    over: tuple[str, ...]
    points: tuple[tuple[float, ...], ...]
    values: tuple[float, ...] | tuple[tuple[float, ...], ...]


#: Typical 1-sigma noise of sensors of small UAVs, used where the aircraft file gives none.
DEFAULT_NOISE: Mapping[str, float] = MappingProxyType(
    {
        "accel": 0.05,  # m/s^2
        "gyro": 0.003,  # rad/s
        "airspeed": 0.3,  # m/s
        "alpha": 0.005,  # rad
        "beta": 0.005,  # rad
        "attitude": 0.005,  # rad
    }
)


#: Delays of an aircraft whose file states none.
NO_DELAYS: Mapping[str, UncertainValue] = MappingProxyType({topic: UncertainValue(0.0) for topic in DELAY_EFFECTS})


@dataclass(frozen=True)
class Aircraft:
    """The validated contents of an aircraft file."""

    name: str
    source: str
    mass: float  # kg
    inertia: Inertia
    geometry: Geometry
    reference: ReferenceCondition
    controls: Mapping[str, Control]  # aerodynamic controls by name, in the file's order
    derivatives: Mapping[str, Derivative]  # by name, in the file's order
    throttle: Throttle | None = None
    sensors: Sensors = field(default_factory=Sensors)
    noise: Mapping[str, float] = field(default_factory=lambda: dict(DEFAULT_NOISE))
    noise_bias: Mapping[str, float] = field(default_factory=lambda: dict(DEFAULT_NOISE_BIAS))  # 1 sigma, SI
    ideal: bool = False  # the file is a simulator's: tolerances that it does not state are zero
    delays: Mapping[str, UncertainValue] = field(default_factory=lambda: dict(NO_DELAYS))  # s, by topic
    effects: Mapping[str, Mapping[str, UncertainValue]] = field(default_factory=dict)  # by effect and parameter
    tables: tuple[LookupTable, ...] = ()
    stated_tolerances: Mapping[str, float] = field(default_factory=dict)  # those of the file, by dotted key
    outputs: str = ""  # which output of an autopilot moves which joint, as in ``flight.autopilots.joints``

    @property
    def control_symbols(self) -> tuple[str, ...]:
        """Symbols of the aerodynamic controls in the file's order, e.g. ``("de", "da", "dr")``."""
        return tuple(control.symbol for control in self.controls.values())

    @property
    def model_structure(self) -> dict[str, tuple[str, ...]]:
        """Regressors of each coefficient: ``{"Cm": ("0", "alpha", "q", "de"), ...}``."""
        return model_structure(self.derivatives)

    @cached_property
    def tolerances(self) -> Mapping[str, float]:
        """1 sigma of every quantity by dotted key: the file's, or the default, or zero where the file is ``ideal``.

        ``default_tolerances`` lists the keys with units and sources. ``controls.<control>.scale`` and ``air_density``
        are relative; all others have the quantity's unit. Instruments' errors and servos have the keys
        ``<effect>.<parameter>``.
        """
        return MappingProxyType(tolerances(_sizes(self), _stated(self), ideal=self.ideal))

    @property
    def stamp_delays(self) -> dict[str, UncertainValue]:
        """How late each topic's stamps are, s: the file's ``delays``, or the effects that mean the same."""
        effects = {topic: self.effects.get(effect, {}).get("delay") for topic, effect in DELAY_EFFECTS.items()}
        return {topic: effects[topic] or delay for topic, delay in self.delays.items()}

    def effect_values(self) -> dict[str, dict[str, float]]:
        """The values of the file's effects by effect and parameter, its delays included."""
        values = {name: {key: item.value for key, item in items.items()} for name, items in self.effects.items()}
        for topic, delay in self.delays.items():
            if delay.value:
                values[DELAY_EFFECTS[topic]] = {"delay": delay.value}
        return values


#: Under which the file's tolerance of the air density is stored, kg/m^3.
_DENSITY = "reference.air_density"

#: Effects that describe errors of instruments and of the CG: every aircraft has them within a tolerance.
_INSTRUMENT_ERRORS = ("imu_scale", "imu_misalignment", "airspeed_scale", "vane_scale", "air_data_lag", "cg_shift")


def _sizes(aircraft: Aircraft) -> dict[str, float]:
    """The size of every quantity that has a tolerance, to which a relative default refers."""
    inertia = {name: moment for name, moment in asdict(aircraft.inertia).items() if not math.isnan(moment)}
    if "Ixz" in inertia:
        inertia["Ixz"] = math.sqrt(inertia.get("Ixx", 0.0) * inertia.get("Izz", 0.0))
    sizes = {"mass": aircraft.mass, "air_density": 1.0}
    sizes |= {f"inertia.{name}": moment for name, moment in inertia.items()}
    sizes |= {f"geometry.{name}": value for name, value in asdict(aircraft.geometry).items()}
    sizes |= {f"sensors.{name}.{axis}": 0.0 for name in ("imu", "air_data") for axis in "xyz"}
    sizes |= {f"controls.{name}.{key}": 0.0 for name in aircraft.controls for key in ("scale", "offset")}
    if aircraft.throttle is not None:
        thrust = {"max_thrust": aircraft.throttle.max_thrust, "inclination": 0.0, "arm": 0.0}
        sizes |= {f"throttle.{key}": size for key, size in thrust.items() if size is not None}
    sizes |= {f"delays.{topic}": 0.0 for topic in DELAY_EFFECTS}
    for effect in _INSTRUMENT_ERRORS:
        sizes |= {f"{effect}.{p.name}": 0.0 for p in EFFECT_NAMES[effect].fixed}
    for effect, values in aircraft.effects.items():
        sizes |= {f"{effect}.{key}": item.value for key, item in values.items()}
    return sizes


def _stated(aircraft: Aircraft) -> dict[str, float]:
    """The tolerances that do not come from the table of defaults."""
    bias = aircraft.noise_bias
    stated = {f"imu_bias.{axis}": bias["accel"] for axis in ("ax", "ay", "az")}
    stated |= {f"imu_bias.{axis}": bias["gyro"] for axis in ("p", "q", "r")}
    stated |= {f"vane_bias.{angle}": bias[angle] for angle in ("alpha", "beta")}
    known = aircraft.effects.get("actuator_lag", {})
    unknown = 0.0 if aircraft.ideal else UNKNOWN_SERVO_LAG
    stated |= {f"actuator_lag.{name}": unknown for name in aircraft.controls if name not in known}
    stated |= {key: value for key, value in aircraft.stated_tolerances.items() if ".joints." not in key}
    if _DENSITY in stated:
        stated["air_density"] = stated.pop(_DENSITY) / aircraft.reference.air_density
    for name, control in aircraft.controls.items():
        scale = _relative_scale(control, aircraft.stated_tolerances)
        stated |= {f"controls.{name}.scale": scale} if scale is not None else {}
    uncertain = {f"delays.{topic}": delay for topic, delay in aircraft.stamp_delays.items()}
    for effect, values in aircraft.effects.items():
        uncertain |= {f"{effect}.{key}": item for key, item in values.items()}
    return stated | {key: item.tolerance for key, item in uncertain.items() if item.tolerance is not None}


def _relative_scale(control: Control, stated: Mapping[str, float]) -> float | None:
    """Relative 1 sigma of a control's deflection from those of its joints' scales; None where none is stated.

    The joints are assumed to move in proportion to their scales, and their errors to be independent.
    """
    keys = {joint: f"controls.{control.name}.joints.{joint}" for joint in control.joints}
    if len(keys) == 1:
        keys = dict.fromkeys(control.joints, f"controls.{control.name}.scale")
    if not any(key in stated for key in keys.values()):
        return None
    variance = sum((control.joints[joint] * stated.get(key, 0.0)) ** 2 for joint, key in keys.items())
    return math.sqrt(variance) / sum(scale**2 for scale in control.joints.values())
