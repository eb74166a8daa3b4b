"""The derivatives that the lookup tables amount to near a steady level flight, for linear models of the aircraft.

Tables over the throttle are left out, for a linear model has none: an imported file's are zero in this flight.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.dynamics import scalar
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.linear_model import level_flight
from sysid_node.dynamics.tables import need_mach, scalar_tables, table_variables

#: Half the step over which slopes are taken (rad, or non-dimensional rates); at a point of a table the mean of both
#: sides counts.
_STEP = 1e-3
#: Most steps of Newton's method to level flight, and the change (rad) at which it has arrived.
_ROUNDS, _ARRIVED = 20, 1e-9


def linear_derivatives(aircraft: Aircraft) -> dict[str, float]:
    """The file's derivatives plus the tables' slopes in level flight at the reference condition, by name.

    The offsets (``CL_0`` ...) include what is left of the tables, so that the linear model meets them in this flight.
    Without tables these are the file's derivatives.
    """
    values = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    return _sum(values, table_derivatives(aircraft)) if _tables(aircraft) else values


def table_derivatives(aircraft: Aircraft) -> dict[str, float]:
    """What the tables add to the derivatives in level flight at the reference dynamic pressure."""
    tables = _tables(aircraft)
    over = {name for table in tables for name in table.over} - {"V", "Mach"}
    return _tangent(aircraft, *trimmed(aircraft), 1.0, sorted(over)) if tables else {}


def trimmed(aircraft: Aircraft, pressure: float = 1.0) -> tuple[float, float]:
    """Alpha and elevator (rad) in level flight, by the file, at ``pressure`` times the reference dynamic pressure.

    With tables by Newton's method; see ``linear_model.level_flight``.
    """
    values = {name: derivative.value for name, derivative in aircraft.derivatives.items()}
    reference = aircraft.reference
    load = dynamic_pressure(reference.air_density, reference.airspeed) * aircraft.geometry.S * pressure
    lift = aircraft.mass * GRAVITY / load
    now = level_flight(values, lift)
    for _ in range(_ROUNDS if _tables(aircraft) else 0):
        before, now = now, level_flight(_sum(values, _tangent(aircraft, *now, pressure, ("alpha", "de"))), lift)
        now = min(max(now[0], -math.pi), math.pi), min(max(now[1], -math.pi), math.pi)
        if max(abs(now[0] - before[0]), abs(now[1] - before[1])) < _ARRIVED:
            break
    return now


def _tables(aircraft: Aircraft) -> list[LookupTable]:
    return [table for table in aircraft.tables if "throttle" not in table.over]


def _tangent(
    aircraft: Aircraft, alpha: float, elevator: float, pressure: float, over: Sequence[str]
) -> dict[str, float]:
    """The tables' slopes over some variables, and offsets, at an angle of attack and elevator (rad), else at rest."""
    reference, geometry = aircraft.reference, aircraft.geometry
    tables = _tables(aircraft)
    density = reference.air_density if need_mach(tables) else None
    flow = (reference.airspeed * math.sqrt(pressure), alpha, 0.0)
    at = table_variables(flow, (0.0, 0.0, 0.0), geometry.b, geometry.cbar, density, scalar)
    at |= dict.fromkeys(aircraft.control_symbols, 0.0) | ({"de": elevator} if "de" in aircraft.control_symbols else {})
    added = scalar_tables(tables)
    found = {f"{coefficient}_0": value for coefficient, value in added(at).items()}
    for name in (name for name in over if name in at):
        above, below = (added({**at, name: at[name] + step}) for step in (_STEP, -_STEP))
        for coefficient, value in above.items():
            slope = (value - below[coefficient]) / (2.0 * _STEP)
            if slope:
                found[f"{coefficient}_{name}"] = slope
                found[f"{coefficient}_0"] -= slope * at[name]
    return {name: value for name, value in found.items() if value}


def _sum(values: Mapping[str, float], added: Mapping[str, float]) -> dict[str, float]:
    return {name: values.get(name, 0.0) + added.get(name, 0.0) for name in (*values, *(added.keys() - values.keys()))}
