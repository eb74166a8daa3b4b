"""What the aircraft file states of its instruments' errors, taken out of every message before the alignment.

The readings of the simulator's station ``sensors`` are inverted in the same order: bias, scale, then mounting. With the
small rotation e of the IMU a reading is x - e x x, whose inverse has a closed form:

    x = (y + e x y + e (e . y)) / (1 + e . e)

Stamps of air data and actuators are moved by how much later theirs are than the IMU's, whose stamps are the time base
and stay: only the times between topics matter. What the file states of the pneumatic lag and of the centre of gravity
is no error of a reading; ``systematic.sources`` begins there. The arithmetic is the same for numbers and columns, bit
for bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.vector import Real, Vector
from sysid_node.flight.topics import ACTUATORS, AIR_DATA

_IMU = ("ax", "ay", "az", "p", "q", "r")
_AXES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class StatedErrors:
    """Errors of the readings, and how much later (ns) the stamps of the topics are than the IMU's."""

    bias: tuple[float, ...] = (0.0,) * 6  # m/s^2, rad/s
    scale: tuple[float, ...] = (1.0,) * 6
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)  # rad, about the body axes
    air_bias: tuple[float, ...] = (0.0,) * 3  # m/s, rad
    air_scale: tuple[float, ...] = (1.0,) * 3
    air_data_late: int = 0  # ns
    actuators_late: int = 0  # ns

    @classmethod
    def of(cls, aircraft: Aircraft) -> StatedErrors:
        """Those of an aircraft file."""
        values = aircraft.effect_values()

        def stated(effect: str, names: Sequence[str]) -> tuple[float, ...]:
            return tuple(values.get(effect, {}).get(name, 0.0) for name in names)

        air = (*stated("airspeed_scale", ("error",)), *stated("vane_scale", ("alpha", "beta")))
        late = {topic: round(delay.value * 1e9) for topic, delay in aircraft.stamp_delays.items()}
        return cls(
            stated("imu_bias", _IMU),
            tuple(1.0 + error for error in stated("imu_scale", _IMU)),
            Vector(*stated("imu_misalignment", _AXES)),
            (0.0, *stated("vane_bias", ("alpha", "beta"))),
            tuple(1.0 + error for error in air),
            late["air_data"] - late["imu"],
            late["actuators"] - late["imu"],
        )

    @property
    def none(self) -> bool:
        """Whether the file states none."""
        return self == _NONE

    @property
    def late(self) -> Mapping[str, int]:
        """How much later (ns) stamps are than the IMU's, by topic."""
        return {AIR_DATA: self.air_data_late, ACTUATORS: self.actuators_late}

    def imu(self, values: tuple[Real, ...]) -> tuple[Real, ...]:
        """Specific force (m/s^2) and rates (rad/s), from their readings."""
        if self.bias == _NONE.bias and self.scale == _NONE.scale and self.turn == _NONE.turn:
            return values
        found = [(y - bias) / scale for y, bias, scale in zip(values, self.bias, self.scale, strict=True)]
        return (*self._turned_back(Vector(*found[:3])), *self._turned_back(Vector(*found[3:])))

    def air_data(self, values: tuple[Real, ...]) -> tuple[Real, ...]:
        """True airspeed (m/s), angle of attack and sideslip (rad), from their readings; what stands behind stays."""
        if self.air_bias == _NONE.air_bias and self.air_scale == _NONE.air_scale:
            return values
        errors = zip(values, self.air_bias, self.air_scale, strict=False)
        return (*((y - bias) / scale for y, bias, scale in errors), *values[3:])

    def _turned_back(self, y: Vector) -> Vector:
        if self.turn == _NONE.turn:
            return y
        e = Vector(*self.turn)
        along = e.x * y.x + e.y * y.y + e.z * y.z
        size = 1.0 + e.x * e.x + e.y * e.y + e.z * e.z
        return y.plus(e.cross(y)).plus(e.times(along)).times(1.0 / size)


_NONE = StatedErrors()
