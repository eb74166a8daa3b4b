"""Thrust of flights on which it was not measured.

It is inferred from the measured forward force and the drag of the aircraft file. Thrust and drag can then not be told
apart, and forward motion is no measurement that could be compared.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.tables import array_tables, mach_number, need_mach
from sysid_node.flight.record import Array, FlightRecord

#: What contains no information then: a channel of forces, and readings of short simulated flights.
THRUST_CHANNEL, THRUST_READINGS = "CD", frozenset({"ax", "V"})


def thrust_missing(aircraft: Aircraft, record: FlightRecord) -> bool:
    """Whether the aircraft has an engine and the record no value of thrust."""
    return aircraft.throttle is not None and not record.measured("thrust")


def with_inferred_thrust(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record with the thrust, N, that the file's lift and drag leave of the forward force.

    It may be negative, because the file's drag may be too small. The accelerometer is taken as at the centre of gravity
    and the flow as at the probe; the error of that is small in the forward direction.
    """
    x, alpha = _regressors(aircraft, record), record["alpha"]
    tabulated = _by_tables(aircraft, record, x)
    lift = _by_file(aircraft, "CL", x) + tabulated.get("CL", 0.0)
    drag = _by_file(aircraft, "CD", {**x, "k": lift**2}) + tabulated.get("CD", 0.0)
    pressure = 0.5 * record["rho"] * record["V"] ** 2 * aircraft.geometry.S
    aerodynamic = pressure * (lift * np.sin(alpha) - drag * np.cos(alpha))
    along = math.cos(aircraft.throttle.inclination if aircraft.throttle else 0.0)
    thrust = (aircraft.mass * record["ax"] - aerodynamic) / along
    return replace(record, columns={**record.columns, "thrust": thrust})


def _regressors(aircraft: Aircraft, record: FlightRecord) -> dict[str, Array]:
    half, geometry = 0.5 / record["V"], aircraft.geometry
    x = {"0": np.ones_like(half), "V": record["V"] / aircraft.reference.airspeed}
    x |= {name: record[name] for name in ("alpha", "beta", *aircraft.control_symbols)}
    lengths = {"p": geometry.b, "q": geometry.cbar, "r": geometry.b}
    return x | {rate: record[rate] * length * half for rate, length in lengths.items()}


def _by_file(aircraft: Aircraft, coefficient: str, x: dict[str, Array]) -> Array:
    """A coefficient (N,) by the aircraft file's derivatives."""
    terms = {n.partition("_")[2]: d.value for n, d in aircraft.derivatives.items() if n.startswith(f"{coefficient}_")}
    return np.asarray(sum((value * x[regressor] for regressor, value in terms.items()), np.zeros_like(x["0"])))


def _by_tables(aircraft: Aircraft, record: FlightRecord, x: dict[str, Array]) -> dict[str, Array]:
    """What the aircraft file's tables add to lift and drag, (N,) each; those over the throttle are left out."""
    of_forces = [table for table in aircraft.tables if table.coefficient in {"CL", "CD"}]
    tables = [table for table in of_forces if "throttle" not in table.over]
    if not tables:
        return {}
    mach = {"Mach": mach_number(record["V"], record["rho"], np)} if need_mach(tables) else {}
    return array_tables(tables)({**x, "V": record["V"], **mach})
