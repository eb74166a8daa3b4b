"""Thrust of flights on which nobody metered it, for the diagnosis.

It is what the aircraft file's drag leaves of the measured forward force: so the simulator keeps the airspeed, thrust
and drag cannot be told apart, and forward motion is no reading that could be compared.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array, FlightRecord

#: What shows nothing then: the channel of forces, and the readings of short flights.
THRUST_CHANNEL, THRUST_READINGS = "CD", frozenset({"ax", "V"})


def thrust_missing(aircraft: Aircraft, record: FlightRecord) -> bool:
    """Whether an aircraft with an engine has a record without one value of thrust."""
    return aircraft.throttle is not None and not record.measured("thrust")


def with_inferred_thrust(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record with the thrust (N) that the file's lift and drag leave; may be negative, as the drag is a belief.

    The accelerometer is taken as at the centre of gravity and the flow as at the probe: what that is off by is forward.
    """
    x, alpha = _regressors(aircraft, record), record["alpha"]
    lift = _by_file(aircraft, "CL", x)
    drag = _by_file(aircraft, "CD", {**x, "k": lift**2})
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
    """A coefficient (N,) of the aircraft file."""
    terms = {n.partition("_")[2]: d.value for n, d in aircraft.derivatives.items() if n.startswith(f"{coefficient}_")}
    return np.asarray(sum((value * x[regressor] for regressor, value in terms.items()), np.zeros_like(x["0"])))
