"""What the estimators make of the effects that an aircraft file states, and what a user is told of the rest.

The simulator flies every effect. The estimators apply the servos to recorded commands, take errors of instruments and
delays of stamps out of the messages, expect the pneumatic lag and the centre of gravity where the file has them, and
take masses and places as the effects change them (``as_estimated``). The size of a few others counts as uncertainty.
All that is left has no place in a linear model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from sysid_node.aircraft.model import Aircraft, UncertainValue, Vector3

#: Effects that change numbers of the file, which ``as_estimated`` puts in their place.
_NUMBERS = frozenset({"mass_error", "inertia_error", "imu_lever_arm", "vane_lever_arm", "thrust_line_offset"})
#: Those whose sizes ``sizes_as_uncertainty`` gives.
_WIDENED = frozenset({"thrust_scale", "actuator_bias"})
#: What the estimators take as the file states it.
_TAKEN = _NUMBERS | {
    *("command_delay", "actuator_lag", "actuator_rate_limit", "motor_lag"),
    *("imu_bias", "imu_scale", "imu_misalignment", "airspeed_scale", "vane_bias", "vane_scale"),
    *("imu_delay", "air_data_delay", "actuator_stamp_delay", "air_data_lag", "cg_shift"),
}
#: What is of the day and not of the aircraft.
_OF_THE_DAY = frozenset({"steady_wind", "turbulence", "gust", "sensor_noise"})


def as_estimated(aircraft: Aircraft) -> Aircraft:
    """The file with the numbers that its effects change, and without these effects.

    A tolerance that an effect states joins that of the number which it changes.
    """
    values = {name: items for name, items in aircraft.effects.items() if name in _NUMBERS}
    if not values:
        return aircraft

    def of(effect: str, key: str) -> float:
        item = values.get(effect, {}).get(key)
        return item.value if item else 0.0

    body, throttle = aircraft.inertia, aircraft.throttle
    moments = {name: getattr(body, name) * (1.0 + of("inertia_error", name)) for name in ("Ixx", "Iyy", "Izz")}
    product = body.Ixz + of("inertia_error", "Ixz") * _of_product(aircraft)
    imu, probe = (
        _moved(place, [of(effect, axis) for axis in "xyz"])
        for effect, place in (("imu_lever_arm", aircraft.sensors.imu), ("vane_lever_arm", aircraft.sensors.air_data))
    )
    return replace(
        aircraft,
        mass=aircraft.mass * (1.0 + of("mass_error", "error")),
        inertia=replace(body, **moments, Ixz=product),
        sensors=replace(aircraft.sensors, imu=imu, air_data=probe),
        throttle=throttle and replace(throttle, arm=throttle.arm + of("thrust_line_offset", "arm")),
        effects={name: items for name, items in aircraft.effects.items() if name not in _NUMBERS},
        stated_tolerances={**aircraft.stated_tolerances, **dict(_tolerances(aircraft, values))},
    )


def stated_cg(aircraft: Aircraft) -> Vector3:
    """Where the file's ``cg_shift`` has the centre of gravity, m from where all its places count from."""
    values = aircraft.effects.get("cg_shift", {})
    x, y, z = (values[axis].value if axis in values else 0.0 for axis in "xyz")
    return x, y, z


def with_places_from_cg(aircraft: Aircraft) -> Aircraft:
    """The file with the places of the sensors from the stated CG; moments stay about the file's point."""
    shift, sensors = stated_cg(aircraft), aircraft.sensors
    if not any(shift):
        return aircraft
    by = [-x for x in shift]
    return replace(
        aircraft, sensors=replace(sensors, imu=_moved(sensors.imu, by), air_data=_moved(sensors.air_data, by))
    )


def _moved(place: Vector3, by: list[float]) -> Vector3:
    x, y, z = (a + b for a, b in zip(place, by, strict=True))
    return x, y, z


def _of_product(aircraft: Aircraft) -> float:
    """The moment of inertia to which a relative error of the product of inertia refers, kg m^2."""
    return math.sqrt(abs(aircraft.inertia.Ixx * aircraft.inertia.Izz))


def _tolerances(aircraft: Aircraft, values: Mapping[str, Mapping[str, UncertainValue]]) -> Iterator[tuple[str, float]]:
    """Tolerances by the keys of the numbers that these effects change."""
    inertia = aircraft.inertia
    units = {"mass_error.error": ("mass", aircraft.mass), "thrust_line_offset.arm": ("throttle.arm", 1.0)}
    units |= {f"inertia_error.{n}": (f"inertia.{n}", getattr(inertia, n)) for n in ("Ixx", "Iyy", "Izz")}
    units["inertia_error.Ixz"] = "inertia.Ixz", _of_product(aircraft)
    for effect, sensor in (("imu_lever_arm", "imu"), ("vane_lever_arm", "air_data")):
        units |= {f"{effect}.{axis}": (f"sensors.{sensor}.{axis}", 1.0) for axis in "xyz"}
    for effect, items in values.items():
        for name, item in items.items():
            key, unit = units[f"{effect}.{name}"]
            if item.tolerance is not None:
                yield key, math.hypot(unit * item.tolerance, aircraft.stated_tolerances.get(key, 0.0))


def sizes_as_uncertainty(aircraft: Aircraft) -> dict[str, float]:
    """Sizes by the keys of tolerances, in their units, of what the file states and the estimators do not correct for.

    Of an effect that states a tolerance this is the root of the sum of both squares.
    """
    throttle = aircraft.throttle
    full = throttle.max_thrust if throttle else None
    units = {"thrust_scale.error": ("throttle.max_thrust", full or 1.0)}
    units |= {f"actuator_bias.{name}": (f"controls.{name}.offset", 1.0) for name in aircraft.controls}
    found = {}
    for effect, items in aircraft.effects.items():
        for name, item in items.items() if effect in _WIDENED else ():
            key, unit = units[f"{effect}.{name}"]
            found[key] = unit * math.hypot(item.value, item.tolerance or 0.0)
    return found if throttle else {key: size for key, size in found.items() if not key.startswith("throttle")}


def not_taken_in_words(aircraft: Aircraft) -> str:
    """A sentence for the reader on the file's effects that the estimators do not know; empty where there are none."""
    stated = [name for name, values in aircraft.effects.items() if any(item.value for item in values.values())]
    widened = [name for name in stated if name in _WIDENED]
    unknown = [name for name in stated if name not in _TAKEN | _WIDENED | _OF_THE_DAY]
    parts = [f"{', '.join(widened)} (the size counts as uncertainty)"] if widened else []
    parts += [f"{', '.join(unknown)} (derivatives and intervals are those of the model without)"] if unknown else []
    return (
        f"Of the aircraft file's effects the estimators do not correct for {', nor for '.join(parts)}." if parts else ""
    )
