"""What the estimators make of the effects that an aircraft file states, and what a user is told of the rest.

The simulator flies every effect. The estimators apply the servos to recorded commands, take errors of instruments and
delays of stamps out of the messages, and expect the pneumatic lag and the centre of gravity where the file has them.
The size of a few others counts as uncertainty. All that is left has no place in a linear model.
"""

from __future__ import annotations

import math

from sysid_node.aircraft.model import Aircraft

#: What the estimators take as the file states it.
_TAKEN = frozenset(
    {
        *("command_delay", "actuator_lag", "actuator_rate_limit", "motor_lag"),
        *("imu_bias", "imu_scale", "imu_misalignment", "airspeed_scale", "vane_bias", "vane_scale"),
        *("imu_delay", "air_data_delay", "actuator_stamp_delay", "air_data_lag", "cg_shift"),
    }
)
#: Those whose sizes ``sizes_as_uncertainty`` gives.
_WIDENED = frozenset(
    {
        *("mass_error", "inertia_error", "thrust_scale", "thrust_line_offset"),
        *("imu_lever_arm", "vane_lever_arm", "actuator_bias"),
    }
)
#: What is of the day and not of the aircraft.
_OF_THE_DAY = frozenset({"steady_wind", "turbulence", "gust", "sensor_noise"})


def sizes_as_uncertainty(aircraft: Aircraft) -> dict[str, float]:
    """Sizes by the keys of tolerances, in their units, of what the file states and the estimators do not correct for.

    Of an effect that states a tolerance this is the root of the sum of both squares.
    """
    inertia, throttle = aircraft.inertia, aircraft.throttle
    units: dict[str, tuple[str, float]] = {"mass_error.error": ("mass", aircraft.mass)}
    units |= {f"inertia_error.{n}": (f"inertia.{n}", getattr(inertia, n)) for n in ("Ixx", "Iyy", "Izz")}
    units["inertia_error.Ixz"] = "inertia.Ixz", math.sqrt(abs(inertia.Ixx * inertia.Izz))
    if throttle is not None:
        units["thrust_scale.error"] = "throttle.max_thrust", throttle.max_thrust or 1.0
        units["thrust_line_offset.arm"] = "throttle.arm", 1.0
    for effect, sensor in (("imu_lever_arm", "imu"), ("vane_lever_arm", "air_data")):
        units |= {f"{effect}.{axis}": (f"sensors.{sensor}.{axis}", 1.0) for axis in "xyz"}
    units |= {f"actuator_bias.{name}": (f"controls.{name}.offset", 1.0) for name in aircraft.controls}
    found = {}
    for effect, values in aircraft.effects.items():
        for name, item in values.items():
            key, unit = units.get(f"{effect}.{name}", ("", 0.0))
            if key:
                found[key] = unit * math.hypot(item.value, item.tolerance or 0.0)
    return found


def not_taken_in_words(aircraft: Aircraft) -> str:
    """A sentence for the reader on the file's effects that the estimators do not know; empty where there are none."""
    stated = [name for name, values in aircraft.effects.items() if any(item.value for item in values.values())]
    others = [name for name in stated if name not in _TAKEN and name not in _OF_THE_DAY]
    if not others:
        return ""
    widened = [name for name in others if name in _WIDENED]
    unknown = [name for name in others if name not in _WIDENED]
    parts = []
    if widened:
        parts.append(f"{', '.join(widened)} (the size counts as uncertainty)")
    if unknown:
        parts.append(f"{', '.join(unknown)} (derivatives and intervals are those of the model without)")
    return f"Of the aircraft file's effects the estimators do not correct for {', nor for '.join(parts)}."
