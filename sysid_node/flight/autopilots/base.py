"""What an adapter hears, what it says, and what it needs to be told."""

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

#: Of dry air, J/(kg K); of the sea-level standard atmosphere, kg/m^3 (ICAO Doc 7488, 1993).
GAS_CONSTANT = 287.05287
SEA_LEVEL_DENSITY = 1.225

Vector = tuple[float, float, float]


class ImuSample(NamedTuple):
    """Forward-right-down axes; the attitude turns them into north-east-down, None = not known."""

    stamp_ns: int
    force: Vector  # m/s^2
    rates: Vector  # rad/s
    attitude: Attitude | None


class AirSample(NamedTuple):
    """NaN = not measured. None of the autopilots measures flow angles."""

    stamp_ns: int
    true_airspeed: float  # m/s
    air_density: float  # kg/m^3
    angle_of_attack: float = math.nan  # rad
    sideslip: float = math.nan  # rad


class JointSample(NamedTuple):
    """Commands: what the autopilot asks of its servos and motors, not where they are."""

    stamp_ns: int
    names: tuple[str, ...]
    positions: tuple[float, ...]  # rad; throttle 0..1


Sample = ImuSample | AirSample | JointSample


#: What the settings may be, by name.
RANGES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"air_temperature": (-60.0, 60.0), "air_data_delay": (0.0, 1.0)}
)


@dataclass(frozen=True)
class AdapterSettings:
    """What no message says. Raises InputError on a value outside ``RANGES``."""

    joints: str = ""  # which output moves which joint; see ``joints_of``
    air_temperature: float = 15.0  # degC, of the outside air where the pressure is measured
    air_data_delay: float = 0.0  # s, by which airspeed is stamped too late

    def __post_init__(self) -> None:
        for name, (lower, upper) in RANGES.items():
            value = getattr(self, name)
            if not lower <= value <= upper:
                raise InputError(f"{name} = {value!r}: expected {lower:g} to {upper:g}")


class Adapter(ABC):
    """Takes an autopilot's messages one by one; remembers what they say in part.

    Raises InputError where the joints are not given or name an output that there is not.
    """

    topics: ClassVar[Mapping[str, str]]  # name -> message type
    outputs: ClassVar[tuple[str, ...]]  # names of servo and motor outputs
    example: ClassVar[str]  # of the parameter joints
    package: ClassVar[str]  # of its messages
    remedy: ClassVar[str]  # where to get that package

    def __init__(self, settings: AdapterSettings) -> None:
        self.settings = settings
        self.joints = joints_of(settings.joints, self.outputs, self.example)
        self.attitude = LastAttitude()
        self.air_density = math.nan  # kg/m^3, held until the next; without it there is no true airspeed

    def hear(self, topic: str, message: Any) -> Sample | None:
        """What a message on one of ``topics`` gives, if anything by itself. Any object with the message's fields."""
        return self.listeners()[topic](message)

    @abstractmethod
    def listeners(self) -> Mapping[str, Callable[[Any], Sample | None]]:
        """What takes the messages of each of the ``topics``."""

    def air(self, stamp_ns: int, true_airspeed: float, density: float) -> AirSample:
        """Air data, stamped when they were measured."""
        return AirSample(stamp_ns - round(1e9 * self.settings.air_data_delay), true_airspeed, density)

    def deflections(self, stamp_ns: int, outputs: Mapping[str, float]) -> JointSample:
        """All joints, NaN where their output is not known."""
        positions = tuple(joint.position(outputs.get(joint.output, math.nan)) for joint in self.joints)
        return JointSample(stamp_ns, tuple(joint.name for joint in self.joints), positions)

    def density(self, pressure: float) -> float:
        """Density (kg/m^3) of dry air at a static pressure (Pa) and the outside air's temperature; NaN below 1 kPa."""
        kelvin = self.settings.air_temperature + 273.15
        return pressure / (GAS_CONSTANT * kelvin) if pressure > 1000.0 else math.nan


def adapter_for(autopilot: str, adapters: Mapping[str, type[Adapter]], settings: AdapterSettings) -> Adapter:
    """The adapter of an autopilot. Raises InputError where there is none of that name."""
    if autopilot not in adapters:
        raise InputError(f"parameter autopilot = {autopilot!r}: expected one of {', '.join(adapters)}")
    return adapters[autopilot](settings)


def header_ns(message: Any) -> int:
    """A header's stamp, ns."""
    return int(message.header.stamp.sec) * 1_000_000_000 + int(message.header.stamp.nanosec)


def numbered(prefix: str, values: Sequence[float]) -> dict[str, float]:
    """Outputs by name, from 1."""
    return {f"{prefix}{i}": float(value) for i, value in enumerate(values, 1)}
