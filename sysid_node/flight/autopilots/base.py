"""The interface of an adapter, the samples that it gives, and its settings."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.attitude import Attitude, LastAttitude
from sysid_node.flight.autopilots.joints import joints_of

#: Gas constant of dry air, J/(kg K), and density of the standard atmosphere at sea level, kg/m^3 (ICAO Doc 7488, 1993).
GAS_CONSTANT = 287.05287
SEA_LEVEL_DENSITY = 1.225

Vector = tuple[float, float, float]


class ImuSample(NamedTuple):
    """Specific force and rates in FRD axes; the attitude rotates these to north-east-down, None = unknown."""

    stamp_ns: int
    force: Vector  # m/s^2
    rates: Vector  # rad/s
    attitude: Attitude | None


class AirSample(NamedTuple):
    """Air data; NaN = not measured. None of the autopilots measures flow angles."""

    stamp_ns: int
    true_airspeed: float  # m/s
    air_density: float  # kg/m^3
    angle_of_attack: float = math.nan  # rad
    sideslip: float = math.nan  # rad


class JointSample(NamedTuple):
    """The commands to servos and motors, not their positions."""

    stamp_ns: int
    names: tuple[str, ...]
    positions: tuple[float, ...]  # rad; throttle 0..1


Sample = ImuSample | AirSample | JointSample


#: The allowed range of each numerical setting.
RANGES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"air_temperature": (-60.0, 60.0), "air_data_delay": (0.0, 1.0)}
)


@dataclass(frozen=True)
class AdapterSettings:
    """What the messages do not say. Raises InputError on a value outside ``RANGES``."""

    joints: str = ""  # the output that moves each joint; see ``joints_of``
    air_temperature: float = 15.0  # degC, of the outside air; used where the pressure alone is measured
    air_data_delay: float = 0.0  # s by which the airspeed's stamps are late

    def __post_init__(self) -> None:
        for name, (lower, upper) in RANGES.items():
            value = getattr(self, name)
            if not lower <= value <= upper:
                raise InputError(f"{name} = {value!r}: expected {lower:g} to {upper:g}")


class Adapter(ABC):
    """Converts an autopilot's messages one by one, and remembers those that are needed for later samples.

    Raises InputError where no joints are given, or one names an unknown output.
    """

    topics: ClassVar[Mapping[str, str]]  # name -> message type
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType({})  # other names in recordings
    essential: ClassVar[tuple[str, str, str]]  # of the topics, those of IMU, airspeed and outputs
    stand_ins: ClassVar[Mapping[str, str]] = MappingProxyType({})  # a topic that serves for one that is not recorded
    outputs: ClassVar[tuple[str, ...]]  # names of servo and motor outputs
    example: ClassVar[str]  # a value of the parameter joints
    package: ClassVar[str]  # that defines its messages
    remedy: ClassVar[str]  # where to get that package

    def __init__(self, settings: AdapterSettings) -> None:
        self.settings = settings
        self.joints = joints_of(settings.joints, self.outputs, self.example)
        self.attitude = LastAttitude()
        self.air_density = math.nan  # kg/m^3, the latest; without it there is no true airspeed

    def hear(self, topic: str, message: Any) -> Sample | None:
        """The sample that a message on one of ``topics`` gives, or None.

        Any object with the message's fields will do.
        """
        return self.listeners()[topic](message)

    @abstractmethod
    def listeners(self) -> Mapping[str, Callable[[Any], Sample | None]]:
        """The function that converts the messages of each topic."""

    def air(self, stamp_ns: int, true_airspeed: float, density: float) -> AirSample:
        """An air data sample, its stamp corrected by the delay."""
        return AirSample(stamp_ns - round(1e9 * self.settings.air_data_delay), true_airspeed, density)

    def deflections(self, stamp_ns: int, outputs: Mapping[str, float]) -> JointSample:
        """The positions of all joints, NaN where the output is unknown."""
        positions = tuple(joint.position(outputs.get(joint.output, math.nan)) for joint in self.joints)
        return JointSample(stamp_ns, tuple(joint.name for joint in self.joints), positions)

    def density(self, pressure: float) -> float:
        """Density (kg/m^3) of dry air at a static pressure (Pa) and the outside air's temperature; NaN below 1 kPa."""
        kelvin = self.settings.air_temperature + 273.15
        return pressure / (GAS_CONSTANT * kelvin) if pressure > 1000.0 else math.nan


def adapter_for(autopilot: str, adapters: Mapping[str, type[Adapter]], settings: AdapterSettings) -> Adapter:
    """The adapter of an autopilot. Raises InputError where the name is unknown."""
    if autopilot not in adapters:
        raise InputError(f"parameter autopilot = {autopilot!r}: expected one of {', '.join(adapters)}")
    return adapters[autopilot](settings)


def header_ns(message: Any) -> int:
    """The stamp of a message's header, ns."""
    return int(message.header.stamp.sec) * 1_000_000_000 + int(message.header.stamp.nanosec)


def numbered(prefix: str, values: Sequence[float]) -> dict[str, float]:
    """Outputs by name: the prefix and a number from 1."""
    return {f"{prefix}{i}": float(value) for i, value in enumerate(values, 1)}
