"""Warnings of values that are possible, but that no aircraft has: most are in another unit than the file's.

The limits are wide on purpose. A wrong unit moves a value by a factor of ten at least, and an unusual aircraft by two.
They are checked whenever a file is read. ``dynamics.handbook.unusual`` has narrower ranges, which need level flight and
modes too, for the page of ``sysid aircraft``.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping

from sysid_node.aircraft.document import DocumentEntry
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import ModelWarning

_GRAVITY = 9.80665  # m/s^2
_LIFT = (0.01, 6.0)  # lift coefficient of level flight at the reference condition
_CHORDS = (0.5, 80.0)  # span over mean chord: of a lifting body, and beyond that of any glider
_GYRATION = (0.02, 1.5)  # radius of gyration over the larger of span and chord
_FARTHEST = 2.0  # distance of a sensor, or arm of the thrust, over the larger of span and chord
_THRUST = 15.0  # greatest thrust over weight: public simulators of small aircraft have up to 11
_LIFT_SLOPE = (0.3, 20.0)  # per rad: one per degree is below
_ANGLE_NOISE = 0.2  # rad
_NOISE = {"accel": (5.0, "m/s^2"), "gyro": (0.5, "rad/s")} | dict.fromkeys(
    ("alpha", "beta", "attitude"), (_ANGLE_NOISE, "rad")
)
_AIRSPEED_NOISE = 0.3  # over the reference airspeed


def warn_of_implausible(fields: Mapping[str, DocumentEntry], aircraft: Aircraft) -> None:
    """Warn (``ModelWarning``, a line each) of what no aircraft has; ``fields`` are the file's by their names."""
    size = max(aircraft.geometry.b, aircraft.geometry.cbar)
    for key, problem in (
        *_weight_and_wing(aircraft),
        *_inertia(aircraft, size),
        *_distances(aircraft, size),
        *_noise(aircraft),
    ):
        entry = fields[key.partition(".")[0]]
        line = f"{entry.file}:{entry.node.start_mark.line + 1}: {key}: {problem}"
        warnings.warn(line, ModelWarning, stacklevel=3)


def _weight_and_wing(aircraft: Aircraft) -> Iterator[tuple[str, str]]:
    weight, geometry, reference = aircraft.mass * _GRAVITY, aircraft.geometry, aircraft.reference
    lift = weight / (0.5 * reference.air_density * reference.airspeed**2 * geometry.S)
    if not _LIFT[0] <= lift <= _LIFT[1]:
        yield (
            "mass",
            f"{aircraft.mass:g} kg at {reference.airspeed:g} m/s on {geometry.S:g} m^2 need a lift coefficient of "
            f"{lift:.3g}; check the units of mass (kg), airspeed (m/s) and S (m^2)",
        )
    chords = geometry.b / geometry.cbar
    if not _CHORDS[0] <= chords <= _CHORDS[1]:
        yield "geometry", f"the span b is {chords:.3g} times the chord cbar; are they exchanged, or in other units?"
    throttle = aircraft.throttle
    if throttle is not None and throttle.max_thrust is not None and throttle.max_thrust > _THRUST * weight:
        yield (
            "controls.throttle.max_thrust",
            f"{throttle.max_thrust:g} N is {throttle.max_thrust / weight:.0f} times the weight; check the unit (N)",
        )
    slope = aircraft.derivatives.get("CL_alpha")
    if slope is not None and slope.value and not _LIFT_SLOPE[0] <= abs(slope.value) <= _LIFT_SLOPE[1]:
        yield "derivatives.CL_alpha", f"{slope.value:g} is the lift slope of no wing; derivatives are per rad"


def _inertia(aircraft: Aircraft, size: float) -> Iterator[tuple[str, str]]:
    for name in ("Ixx", "Iyy", "Izz"):
        moment = getattr(aircraft.inertia, name)
        radius = math.sqrt(moment / aircraft.mass)
        if not math.isnan(moment) and not _GYRATION[0] * size <= radius <= _GYRATION[1] * size:
            yield (
                f"inertia.{name}",
                f"{moment:g} kg m^2 is a radius of gyration of {radius:.3g} m where span and chord are at most "
                f"{size:g} m; check the units (kg m^2, and mass in kg)",
            )


def _distances(aircraft: Aircraft, size: float) -> Iterator[tuple[str, str]]:
    for name in ("imu", "air_data"):
        distance = math.hypot(*getattr(aircraft.sensors, name))
        if distance > _FARTHEST * size:
            yield f"sensors.{name}", _too_far(distance, size)
    if aircraft.throttle is not None and abs(aircraft.throttle.arm) > _FARTHEST * size:
        yield "controls.throttle.arm", _too_far(abs(aircraft.throttle.arm), size)


def _too_far(distance: float, size: float) -> str:
    return f"{distance:.3g} m from the CG where span and chord are at most {size:g} m; check the unit (m)"


def _noise(aircraft: Aircraft) -> Iterator[tuple[str, str]]:
    limits = _NOISE | {"airspeed": (_AIRSPEED_NOISE * aircraft.reference.airspeed, "m/s")}
    for name, (most, unit) in limits.items():
        if aircraft.noise[name] > most:
            yield f"noise.{name}", f"{aircraft.noise[name]:g} {unit} (1 sigma) is above {most:.3g}; check the unit"
