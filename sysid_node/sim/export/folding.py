"""Effects that are merely other numbers of an aircraft file, folded into it.

A mass that differs, other moments of inertia, errors of derivatives, another scale or line of the thrust: a simulator
holds them as soon as the model has the other numbers. What remains are effects that change the form of the equations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from sysid_node.aircraft.model import Aircraft, Derivative

Effects = Mapping[str, Mapping[str, float]]

#: The effects that ``folded`` takes into the aircraft's own numbers.
FOLDED = ("mass_error", "inertia_error", "derivative_error", "thrust_scale", "thrust_line_offset")


def folded(aircraft: Aircraft, effects: Effects) -> tuple[Aircraft, dict[str, dict[str, float]]]:
    """The aircraft with these effects in its numbers and none of its own, and the effects that remain."""
    rest = {name: dict(values) for name, values in effects.items() if any(values.values())}
    changed = replace(aircraft, effects={}, delays={})
    changed = replace(changed, mass=aircraft.mass * (1.0 + rest.pop("mass_error", {}).get("error", 0.0)))
    changed = _inertia(changed, rest.pop("inertia_error", {}))
    errors = rest.pop("derivative_error", {})
    derivatives = {
        name: Derivative(d.value + errors.get(name, 0.0), d.tolerance) for name, d in aircraft.derivatives.items()
    }
    changed = replace(changed, derivatives=derivatives)
    throttle = changed.throttle
    if throttle is not None:
        arm = throttle.arm + rest.pop("thrust_line_offset", {}).get("arm", 0.0)
        changed = replace(changed, throttle=replace(throttle, arm=arm))
        if throttle.max_thrust is not None and not _over_throttle(aircraft):
            full = throttle.max_thrust * (1.0 + rest.pop("thrust_scale", {}).get("error", 0.0))
            changed = replace(changed, throttle=replace(throttle, arm=arm, max_thrust=full))
    return changed, rest


def thrust_factor(rest: Effects) -> float:
    """The factor of the thrust that could not be folded, because tables are over the throttle or it is in newtons."""
    return 1.0 + rest.get("thrust_scale", {}).get("error", 0.0)


def _inertia(aircraft: Aircraft, error: Mapping[str, float]) -> Aircraft:
    own = aircraft.inertia
    if not error:
        return aircraft
    straight = {name: getattr(own, name) * (1.0 + error.get(name, 0.0)) for name in ("Ixx", "Iyy", "Izz")}
    cross = own.Ixz + error.get("Ixz", 0.0) * math.sqrt(own.Ixx * own.Izz)
    return replace(aircraft, inertia=replace(own, **straight, Ixz=cross))


def _over_throttle(aircraft: Aircraft) -> bool:
    return any("throttle" in table.over for table in aircraft.tables)
