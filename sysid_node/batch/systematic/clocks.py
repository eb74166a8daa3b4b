"""Flights whose servos and instruments are as late as they are thought to be: an estimated lateness is taken out.

A control follows what is recorded of it with the response 1 / (1 + L s + B s^2) (``online.systematic.servo_model``).
What the aircraft file's servo has made of the commands already, with L0 and B0, is undone: the record's deflection is
multiplied by (1 + L0 s + B0 s^2) / (1 + L s + B s^2) in the frequency domain. Instruments whose stamps are late are
read that much later.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.interpolate import CubicSpline

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.systematic.flight_posterior import Imperfection
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.flight.servos import servos_of
from sysid_node.online.systematic.servo_model import CUBIC, of_servo

_AIR = ("V", "alpha", "beta")
#: Columns that each key's lateness moves; ``delays.actuators`` moves the controls.
LATE_COLUMNS: Mapping[str, tuple[str, ...]] = {
    "delays.imu": ("ax", "ay", "az", "p", "q", "r"),
    "delays.air_data": _AIR,
    "air_data_lag.time_constant": _AIR,
    "delays.actuators": (),
}
_Response = tuple[float, float, float]  # lateness (s), curvature (s^2), third coefficient (s^3)
SETTLED = 2.0  # s by which a record is continued at its ends, so that its other end does not reach round


def is_timing(one: Imperfection) -> bool:
    """Whether an imperfection is one of time, which ``corrected`` takes out."""
    return one.role != "source" or one.key in LATE_COLUMNS


def corrected(aircraft: Aircraft, record: FlightRecord, values: Mapping[Imperfection, float]) -> FlightRecord:
    """The record with the lateness ``values`` (s) of instruments and servos taken out.

    A servo's curvature is in s^2, its third coefficient in s^3.
    """
    late: dict[str, float] = {}
    for one, value in values.items():
        if one.role == "source" and one.key in LATE_COLUMNS:
            for column in LATE_COLUMNS[one.key] or aircraft.control_symbols:
                late[column] = late.get(column, 0.0) + value
    columns = dict(record.columns)
    for name, control in aircraft.controls.items():
        servo = {one.role: v for one, v in values.items() if one.control == name and one.commanded == record.commanded}
        if servo and record.measured(control.symbol):
            columns[control.symbol] = _followed(aircraft, record, name, servo)
    for column, delay in late.items():
        if column in columns:
            columns[column] = read_later(record.time, columns[column], delay)
    return replace(record, columns=columns)


def read_later(
    time: Array, values: Array, delay: float, interpolator: Callable[..., Callable[[Array], Array]] = CubicSpline
) -> Array:
    """The signal ``delay`` s later; what is missing remains so."""
    known = np.isfinite(values)
    if delay == 0.0 or np.count_nonzero(known) < 4:
        return values
    moments = np.clip(time + delay, time[known][0], time[known][-1])
    return np.where(known, interpolator(time[known], values[known])(moments), np.nan)


def _followed(aircraft: Aircraft, record: FlightRecord, name: str, servo: Mapping[str, float]) -> Array:
    """The control's deflection behind a servo with the ``lateness``, ``curvature`` and ``third`` given."""
    place = list(aircraft.controls).index(name)
    applied = of_servo(servos_of(aircraft)[1 + place]) if record.commanded else (0.0, 0.0, 0.0)
    values = record[aircraft.controls[name].symbol]
    late, curved = servo.get("lateness", applied[0]), servo.get("curvature", applied[1])
    third = applied[2] + CUBIC * (late * curved - applied[0] * applied[1]) + servo.get("third", 0.0)
    found = late, curved, third
    known = np.isfinite(values)
    if found == applied or np.count_nonzero(known) < 2:
        return values
    step = float(np.median(np.diff(record.time)))
    count = int(record.duration / step) + 1
    even = record.time[0] + step * np.arange(count)
    signal = np.interp(even, record.time[known], values[known])
    return values + np.interp(record.time, even, _change(signal, step, applied, found))


def _change(signal: Array, step: float, applied: _Response, found: _Response) -> Array:
    """What the other servo changes of an evenly sampled ``signal`` (N,)."""
    margin = int(SETTLED / step)
    size = next_fast_len(signal.size + 2 * margin, real=True)
    # from the last value back to the first along a cosine, so that the periodic signal has no jump
    after = size - signal.size - margin
    blend = 0.5 - 0.5 * np.cos(np.pi * (np.arange(after) + 1) / (after + 1))
    whole = np.concatenate([np.full(margin, signal[0]), signal, signal[-1] + (signal[0] - signal[-1]) * blend])
    s = 2j * np.pi * rfftfreq(size, step)
    (L0, B0, C0), (L, B, C) = applied, found
    gain = s * (L0 - L + s * (B0 - B + s * (C0 - C))) / (1.0 + s * (L + s * (B + s * C)))
    return np.asarray(irfft(gain * rfft(whole), size)[margin : margin + signal.size])
