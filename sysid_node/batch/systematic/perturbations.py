"""Flights and aircraft files as they would be with another value of what is taken as known.

A regression that keeps slow motion, as equation error does, answers an imperfection otherwise than the online
estimator, which leaves trim and drift out: a roll misalignment of the IMU, say, mixes lift into the side force. So its
sensitivities are its own, by regression on what these changes make of the residuals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array, FlightRecord

_AXES = "xyz"
_RATES = ("p", "q", "r")
_FORCES = ("ax", "ay", "az")
_TURNS = ("roll", "pitch", "yaw")


def perturbed(aircraft: Aircraft, record: FlightRecord, key: str, by: float) -> tuple[Aircraft, FlightRecord] | None:
    """The aircraft file and the flight where a quantity is larger ``by`` than was taken; None for other quantities.

    ``key`` is that of its tolerance, in whose unit ``by`` is.
    """
    file = _other_file(aircraft, key, by)
    if file is not None:
        return file, record
    changed = _other_columns(aircraft, record, key, by)
    return None if changed is None else (aircraft, replace(record, columns={**record.columns, **changed}))


def _other_file(aircraft: Aircraft, key: str, by: float) -> Aircraft | None:
    """The file with another mass, inertia, geometry or place of a sensor."""
    kind, _, name = key.rpartition(".")
    if key == "mass":
        return replace(aircraft, mass=aircraft.mass + by)
    if kind in ("inertia", "geometry"):
        part = getattr(aircraft, kind)
        return replace(aircraft, **{kind: replace(part, **{name: getattr(part, name) + by})})
    if kind in ("sensors.imu", "sensors.air_data"):
        sensor = kind.partition(".")[2]
        place = list(getattr(aircraft.sensors, sensor))
        place[_AXES.index(name)] += by
        return replace(aircraft, sensors=replace(aircraft.sensors, **{sensor: (place[0], place[1], place[2])}))
    return None


def _other_columns(aircraft: Aircraft, record: FlightRecord, key: str, by: float) -> dict[str, Array] | None:
    """The columns of what an instrument measured: one that reads too much has measured less."""
    kind, _, name = key.rpartition(".")
    if kind == "imu_misalignment":
        return _turned(record, _TURNS.index(name), by)
    if kind.startswith("controls.") or key.startswith("controls."):
        symbol = aircraft.controls[key.split(".")[1]].symbol
        return {symbol: record[symbol] * (1.0 + by) if name == "scale" else record[symbol] + by}
    column, scale, shift = {
        "imu_scale": (name, -by, 0.0),
        "imu_bias": (name, 0.0, -by),
        "vane_scale": (name, -by, 0.0),
        "vane_bias": (name, 0.0, -by),
        "airspeed_scale": ("V", -by, 0.0),
        "": {"airspeed_bias": ("V", 0.0, -by), "air_density": ("rho", by, 0.0)}.get(key, ("", 0.0, 0.0)),
    }.get(kind, ("", 0.0, 0.0))
    if not column or column not in record.columns or not np.isfinite(record[column]).any():
        return None
    return {column: record[column] * (1.0 + scale) + shift}


def _turned(record: FlightRecord, about: int, by: float) -> dict[str, Array]:
    """Rates and accelerations of an IMU that is turned ``by`` rad about an axis."""
    one, other = (about + 1) % 3, (about + 2) % 3
    changed = {}
    for names in (_RATES, _FORCES):
        changed[names[one]] = record[names[one]] - by * record[names[other]]
        changed[names[other]] = record[names[other]] + by * record[names[one]]
    return changed
