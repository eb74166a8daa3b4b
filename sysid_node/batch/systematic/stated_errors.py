"""Flights without the errors of instruments and stamps that the aircraft file states, as the online estimator has them.

The online estimator takes them out of messages before the alignment. Records, tables among them, are aligned already:
here columns are read later by how much later their stamps are than the IMU's. Controls are read by a piecewise cubic
that keeps steps as they are (Fritsch & Carlson, SIAM J. Numer. Anal. 17, 1980): a spline would ring about them.
"""

from __future__ import annotations

from dataclasses import replace

from scipy.interpolate import CubicSpline, PchipInterpolator

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.systematic.clocks import read_later
from sysid_node.flight.record import FlightRecord
from sysid_node.online.alignment.stated_errors import StatedErrors

_IMU = ("ax", "ay", "az", "p", "q", "r")
_AIR = ("V", "alpha", "beta")


def without_stated_errors(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it would be with instruments and stamps that are right."""
    errors = StatedErrors.of(aircraft)
    if errors.none:
        return record
    columns = dict(record.columns)
    for names, correct in ((_IMU, errors.imu), (_AIR, errors.air_data)):
        found = dict(zip(names, correct(tuple(record[name] for name in names)), strict=True))
        columns |= {name: values for name, values in found.items() if name in columns}
    for topic, late, interpolator in (
        ((*_AIR, "rho"), errors.air_data_late, CubicSpline),
        (("thrust", *aircraft.control_symbols), errors.actuators_late, PchipInterpolator),
    ):
        for name in [name for name in topic if name in columns]:
            columns[name] = read_later(record.time, columns[name], late / 1e9, interpolator)
    return replace(record, columns=columns)
