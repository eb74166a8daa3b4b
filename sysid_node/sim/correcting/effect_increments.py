"""The increments of coefficients, forces and moments by which one aircraft file differs from another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import split_derivative
from sysid_node.sim.correcting.jsbsim_loads import REGRESSORS, Factor, Increments, less, metres, one_over
from sysid_node.sim.importing.jsbsim.program import FOOT
from sysid_node.sim.model.layout import reference_flight

#: Controls in the propeller's slipstream.
IN_SLIPSTREAM = ("elevator", "rudder")

#: The model's own lift coefficient, of the frame before, and the thrust in lbf.
OWN_LIFT: tuple[Factor, ...] = ("forces/fwz-aero-lbs", one_over("aero/qbar-psf", "metrics/Sw-sqft"))

Change = Mapping[str, float]


@dataclass(frozen=True)
class ModelProperties:
    """The properties of a JSBSim model that increments read."""

    deflections: Mapping[str, tuple[str, float]]  # by control: property, and rad (the aircraft file's sign) per unit
    thrust: str | None  # of the thrust along the body's x axis, lbf
    lift: tuple[Factor, ...] = OWN_LIFT  # of the lift coefficient


def increments_between(before: Aircraft, after: Aircraft, model: ModelProperties) -> Increments:
    """What ``after`` adds to the loads of ``before``, for effects that act without a state of their own."""
    found = Increments()
    _derivatives(found, before, after, model)
    old, new = before.effect_values(), after.effect_values()
    for effect, write in _WRITERS.items():
        if old.get(effect, {}) != new.get(effect, {}):
            names = {*old.get(effect, {}), *new.get(effect, {})}
            change = {n: new.get(effect, {}).get(n, 0.0) - old.get(effect, {}).get(n, 0.0) for n in names}
            write(found, change, after, model)
    return found


#: Effects that are increments of loads.
def load_effects() -> tuple[str, ...]:
    """The effects that ``increments_between`` writes."""
    return tuple(_WRITERS)


def regressor(name: str, before: Aircraft, model: ModelProperties) -> tuple[float, tuple[Factor, ...]]:
    """A regressor of the aircraft file as a value times JSBSim's properties."""
    if name == "0":
        return 1.0, ()
    if name == "V":
        return FOOT / before.reference.airspeed, REGRESSORS["V"]
    if name == "k":
        return 1.0, (*model.lift, *model.lift)
    controls = {control.symbol: key for key, control in before.controls.items()}
    if name in controls:
        place, unit = model.deflections[controls[name]]
        return unit, (place,)
    return 1.0, REGRESSORS[name]


def _derivatives(found: Increments, before: Aircraft, after: Aircraft, model: ModelProperties) -> None:
    wrong, errors = (a.effect_values().get("derivative_error", {}) for a in (before, after))
    for name, derivative in after.derivatives.items():
        change = derivative.value + errors.get(name, 0.0) - before.derivatives[name].value - wrong.get(name, 0.0)
        coefficient, variable = split_derivative(name)
        unit, factors = regressor(variable, before, model)
        found.add(coefficient, change * unit, *factors)


def _alpha(aircraft: Aircraft, power: int = 1) -> Factor:
    """alpha counted from the reference condition, to a power."""
    return less("aero/alpha-rad", reference_flight(aircraft)[1], power)


def _pitching(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    found.add("Cm", change.get("quadratic", 0.0), _alpha(aircraft, 2))
    found.add("Cm", change.get("cubic", 0.0), _alpha(aircraft, 3))


def _unsteady(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    for coefficient in ("CL", "Cm"):
        found.add(coefficient, change.get(f"{coefficient}_alphadot", 0.0), *REGRESSORS["alphadot"])


def _coupling(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    for name, value in change.items():
        coefficient, variable, _ = name.split("_")
        found.add(coefficient, value, *REGRESSORS[variable], _alpha(aircraft))


def _asymmetry(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    for name, value in change.items():
        found.add(name.partition("_")[0], value)


def _drag_rise(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    lift, _ = reference_flight(aircraft)
    value = change.get("parabola", 0.0)  # (CL - CL0)^2 written out
    found.add("CD", value, *model.lift, *model.lift)
    found.add("CD", -2.0 * lift * value, *model.lift)
    found.add("CD", lift * lift * value)


def _nonlinear_controls(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    for control, cubic in change.items():
        for coefficient, slope in _slopes(aircraft, control):
            unit, factors = regressor(aircraft.controls[control].symbol, aircraft, model)
            found.add(coefficient, -slope * cubic * unit**3, *factors * 3)


def _propwash(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    if model.thrust is None:
        return
    for control in IN_SLIPSTREAM:
        for coefficient, slope in _slopes(aircraft, control):
            unit, factors = regressor(aircraft.controls[control].symbol, aircraft, model)
            pressure = one_over("aero/qbar-psf", "metrics/Sw-sqft")
            found.add(
                coefficient,
                slope * change.get("gain", 0.0) * unit,
                *factors,
                model.thrust,
                pressure,
            )


def _slopes(aircraft: Aircraft, control: str) -> list[tuple[str, float]]:
    """The coefficients that depend on a control, with their slopes."""
    if control not in aircraft.controls:
        return []
    symbol = aircraft.controls[control].symbol
    pairs = ((split_derivative(name), d.value) for name, d in aircraft.derivatives.items())
    return [(coefficient, value) for (coefficient, variable), value in pairs if variable == symbol]


def _thrust_scale(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    error = change.get("error", 0.0)
    if model.thrust == "forces/fbx-prop-lbs":
        for axis, force in zip("XYZ", "xyz", strict=True):
            found.add(axis, error, f"forces/fb{force}-prop-lbs")
        for axis, moment in zip("LMN", "lmn", strict=True):
            found.add(axis, error, f"moments/{moment}-prop-lbsft")
    elif model.thrust is not None and aircraft.throttle is not None:
        found.add("X", error, model.thrust)
        found.add("M", error * metres(aircraft.throttle.arm), model.thrust)


def _thrust_line(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    if model.thrust is not None:
        found.add("M", metres(change.get("arm", 0.0)), model.thrust)


def _thrust_yaw(found: Increments, change: Change, aircraft: Aircraft, model: ModelProperties) -> None:
    if model.thrust is None:
        return
    found.add("N", metres(change.get("arm", 0.0)), model.thrust)
    found.add("N", metres(change.get("p_factor", 0.0)), model.thrust, "aero/alpha-rad")
    found.add("L", metres(change.get("torque_arm", 0.0)), model.thrust)


_WRITERS: Mapping[str, Callable[[Increments, Change, Aircraft, ModelProperties], None]] = {
    "nonlinear_pitching_moment": _pitching,
    "unsteady_aerodynamics": _unsteady,
    "lateral_alpha_coupling": _coupling,
    "lateral_asymmetry": _asymmetry,
    "drag_rise": _drag_rise,
    "control_nonlinearity": _nonlinear_controls,
    "propwash": _propwash,
    "thrust_scale": _thrust_scale,
    "thrust_line_offset": _thrust_line,
    "thrust_yaw": _thrust_yaw,
}
