"""Attitude and way of a flight through the air, from its recorded columns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.attitude import euler_rates, quaternion, to_earth
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import Array, FlightRecord


class Poses(NamedTuple):
    """Where an aircraft is: ``position`` (N, 3) m north-east-down, ``attitude`` (N, 4), a quaternion, scalar first.

    ``known``: whether roll and pitch were measured. If not, the aircraft stands level at the origin.
    """

    position: Array
    attitude: Array
    known: bool


def poses(record: FlightRecord) -> Poses:
    """Where the aircraft was at each sample.

    The way is integrated from airspeed, flow angles and attitude (trapezoidal rule), and so it is one through the air:
    wind is not in it. A heading that was not measured is integrated from the body rates. Flow angles that were not
    measured count as zero.
    """
    if not (record.measured("phi") and record.measured("theta")):
        level = np.tile([1.0, 0.0, 0.0, 0.0], (len(record), 1))
        return Poses(np.zeros((len(record), 3)), level, known=False)
    roll, pitch = (filled(record.time, record[name]) for name in ("phi", "theta"))
    attitude = attitude_of(roll, pitch, _heading(record, roll, pitch))
    air = [filled(record.time, record[name]) for name in ("V", "alpha", "beta")]
    return Poses(integrated(record.time, earth_velocity(attitude, *air)), attitude, known=True)


def attitude_of(roll: Array, pitch: Array, heading: Array) -> Array:
    """Quaternions (N, 4), scalar first, of Euler angles (N,) rad."""
    return np.column_stack(quaternion((roll, pitch, heading), np))


def earth_velocity(attitude: Array, airspeed: Array, alpha: Array, beta: Array) -> Array:
    """Velocity (N, 3) through the air, m/s north-east-down."""
    body = Vector(*velocity_of((airspeed, alpha, beta), np))
    return np.column_stack(to_earth(tuple(attitude.T), body))


def integrated(time: Array, velocity: Array) -> Array:
    """Position (N, 3) from velocity (N, 3) at times (N,), zero at the first, by the trapezoidal rule."""
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)[:, None]
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def filled(time: Array, values: Array) -> Array:
    """Values (N,) with gaps (NaN) bridged linearly; zeros where nothing was measured."""
    known = np.isfinite(values)
    return np.interp(time, time[known], values[known]) if known.any() else np.zeros_like(values)


def _heading(record: FlightRecord, roll: Array, pitch: Array) -> Array:
    if record.measured("psi"):
        known = np.isfinite(record["psi"])
        turned = np.unwrap(record["psi"][known])
        return np.interp(record.time, record.time[known], turned)
    rates = Vector(*(filled(record.time, record[name]) for name in "pqr"))
    turning = np.asarray(euler_rates(roll, pitch, rates, np).z)
    return integrated(record.time, np.column_stack([turning, turning, turning]))[:, 0]
