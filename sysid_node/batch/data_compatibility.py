"""Data compatibility: errors of IMU and air data from the kinematics alone, without aerodynamics.

The integrated accelerations and rates of the IMU must agree with the air data and the attitude: Klein & Morelli,
"Aircraft System Identification" (2006), ch. 10. The sensor errors are estimated by filter error on the kinematic model,
because the IMU's noise and the gusts are its process noise. Each piece of the flight has its own initial state; the
errors are common to all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.methods.filter_error import filter_error
from sysid_node.batch.models.kinematics import STATES, sensor_errors
from sysid_node.batch.models.manoeuvres import cut_into_segments, manoeuvre_data, with_forces_at_cg
from sysid_node.batch.regression.filtering import block_averaged
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord

#: Hz to which flights are averaged here: the kinematics have no fast modes.
_RATE = 50.0
_IMU = ("ax", "ay", "az", "p", "q", "r")


@dataclass(frozen=True)
class Compatibility:
    """The estimated sensor errors, and the flights corrected for them."""

    fit: BatchFit
    corrected: list[FlightRecord]
    remarks: tuple[str, ...]


def check_sensors(aircraft: Aircraft, records: Sequence[FlightRecord], segment: float = 10.0) -> Compatibility:
    """The sensor errors common to all flights, each of which is cut into pieces of ``segment`` s.

    Raises InputError where a flight lacks the IMU or all of airspeed, flow angles and attitude.
    """
    outputs = [name for name in STATES if all(record.measured(name) for record in records)]
    if "V" not in outputs:
        raise InputError("kinematic consistency needs the airspeed, and not every flight measured it")
    model = sensor_errors(outputs, aircraft.sensors.air_data)
    pieces = [piece for record in records for piece in _pieces(aircraft, record, segment)]
    manoeuvres = [manoeuvre_data(model, piece) for piece in pieces]
    fit = filter_error(model, manoeuvres, initial_states=STATES)
    return Compatibility(fit, [corrected(record, fit.values) for record in records], _remarks(fit))


def corrected(record: FlightRecord, errors: dict[str, float]) -> FlightRecord:
    """The record corrected for these sensor errors."""
    columns = dict(record.columns)
    for name in set(columns) & {*_IMU, *STATES}:
        bias, scale = errors.get(f"bias_{name}", 0.0), errors.get(f"scale_{name}", 0.0)
        columns[name] = (columns[name] - bias) / (1.0 + scale)
    return replace(record, columns=columns)


def _pieces(aircraft: Aircraft, record: FlightRecord, segment: float) -> list[FlightRecord]:
    missing = [name for name in _IMU if not record.measured(name)]
    if missing:
        raise InputError(f"flight {record.name!r}: kinematic consistency needs {', '.join(missing)}, not measured")
    unwrapped = dict(record.columns)
    if record.measured("psi"):
        unwrapped["psi"] = np.unwrap(unwrapped["psi"])
    whole = FlightRecord(record.time, unwrapped, record.name, record.start_ns, record.rejected)
    return cut_into_segments(block_averaged(with_forces_at_cg(aircraft, whole), _RATE), segment)


def _remarks(fit: BatchFit) -> tuple[str, ...]:
    """A sentence with the errors that are larger than two standard errors."""
    significant = [e for e in fit.estimates.values() if abs(e.value) > 2.0 * e.standard_error]
    if not significant:
        return ("the sensors agree with one another: no error of IMU or air data stands out",)
    listed = ", ".join(f"{e.name} {e.value:+.4g} +- {e.standard_error:.2g}" for e in significant)
    return (f"sensor errors taken out: {listed}",)
