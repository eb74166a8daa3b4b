"""Whether estimates show that controls or the side force are recorded otherwise than the aircraft file says.

A surface that is counted the other way has derivatives of the other sign, and positions from -1 to 1 have derivatives
that are the limit in rad times those of the file. Nothing else in a flight shows either.
"""

from __future__ import annotations

from collections.abc import Mapping

from sysid_node.aircraft.common_factors import Estimated, certain, common_factors
from sysid_node.aircraft.model import Aircraft, Control

_MOMENTS = ("Cl", "Cm", "Cn")
_ALIKE = 0.25  # share within which a factor is the limit in rad
_FEWEST = 2  # controls that must show it: one alone may have lost a part of its effect


def opposite_estimates(aircraft: Aircraft, estimates: Mapping[str, Estimated]) -> list[str]:
    """What valid estimates show, a sentence each; none where nothing is wrong."""
    found = [*reversed_controls(aircraft, estimates), *other_readings(aircraft, estimates)]
    return found or common_factors(aircraft, estimates)


def reversed_controls(aircraft: Aircraft, estimates: Mapping[str, Estimated]) -> list[str]:
    """Controls that are counted the other way, a sentence each."""
    return [
        f"{name} is {estimates[name].value:.3g}, and of the other sign in the aircraft file: is {control} counted the "
        "other way? If the axes of the rates are right, change its joint's sign"
        for control, (name, factor) in _factors(aircraft, estimates).items()
        if factor < 0.0
    ]


def other_readings(aircraft: Aircraft, estimates: Mapping[str, Estimated]) -> list[str]:
    """Positions from -1 to 1, and a side force of the wrong sign, a sentence each."""
    found = _positions_as_shares(aircraft, estimates)
    side = estimates.get("CY_beta")
    if side is not None and certain(side) and side.value > 0.0:
        found.append(f"CY_beta is {side.value:.3g}, and negative for aircraft: is the sign of ay right?")
    return found


def _positions_as_shares(aircraft: Aircraft, estimates: Mapping[str, Estimated]) -> list[str]:
    """The sentence that is said where derivatives by all controls are as of positions from -1 to 1."""
    factors = {control: factor for control, (_, factor) in _factors(aircraft, estimates).items()}
    limits = {name: aircraft.controls[name].limit for name in factors}
    if len(factors) < _FEWEST or not all(
        limit and abs(abs(factors[name]) / limit - 1.0) < _ALIKE for name, limit in limits.items()
    ):
        return []
    times = ", ".join(f"{factor:.2f}" for factor in factors.values())
    return [
        f"derivatives by {', '.join(factors)} are {times} times those of the aircraft file, as the limits in rad are: "
        "are the positions from -1 to 1? If so, multiply the joints' scales by the limits"
    ]


def _factors(aircraft: Aircraft, estimates: Mapping[str, Estimated]) -> dict[str, tuple[str, float]]:
    """By control its strongest derivative, where its sign is certain, and the estimate by the value of the file."""
    strongest = {control.name: _strongest_moment(aircraft, control) for control in aircraft.controls.values()}
    return {
        control: (name, estimates[name].value / aircraft.derivatives[name].value)
        for control, name in strongest.items()
        if name in estimates and certain(estimates[name])
    }


def _strongest_moment(aircraft: Aircraft, control: Control) -> str:
    """The derivative of a moment by the control that is the largest by the file; empty where there is none."""
    names = [f"{moment}_{control.symbol}" for moment in _MOMENTS]
    known = [name for name in names if name in aircraft.derivatives and aircraft.derivatives[name].value]
    return max(known, key=lambda name: abs(aircraft.derivatives[name].value), default="")
