"""A flight with the noise of its sensors added once more, from which the power of that noise is measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.gap_flight import GapFlight, with_inferred_signals

#: Columns that each sensor's noise falls on, by the sensor's name in the aircraft file.
_NOISE = {
    "accel": ("ax", "ay", "az"),
    "gyro": ("p", "q", "r"),
    "airspeed": ("V",),
    "alpha": ("alpha",),
    "beta": ("beta",),
    "attitude": ("phi", "theta", "psi"),
}

#: Sensors that are sampled with the IMU; the others are sampled with the air data.
_IMU_SENSORS = frozenset({"accel", "gyro", "attitude"})


def with_added_noise(aircraft: Aircraft, flight: GapFlight, random: np.random.Generator) -> GapFlight:
    """The flight with another realisation of its sensors' noise and of its commands' sampling.

    The noise of a topic that was sampled more slowly than the record is proportionally stronger, so that its power in
    the band is that of the topic. Flow angles and a thrust that nobody measured are inferred anew.
    """
    record = flight.record
    record_rate = 1.0 / float(np.median(np.diff(record.time)))
    columns = dict(record.columns)
    for sensor, names in _NOISE.items():
        rate = flight.imu_rate if sensor in _IMU_SENSORS else flight.air_rate
        spread = aircraft.noise[sensor] * np.sqrt(record_rate / min(rate, record_rate))
        for name in names:
            if name in columns and name not in flight.filled:
                columns[name] = columns[name] + spread * random.standard_normal(len(record))
    columns |= _resampled_commands(aircraft, flight, random)
    return with_inferred_signals(aircraft, replace(flight, record=replace(record, columns=columns)))


def _resampled_commands(aircraft: Aircraft, flight: GapFlight, random: np.random.Generator) -> dict[str, Array]:
    """Commands (N,) as other samples of the same rate might have caught them: a step falls anywhere between two."""
    record, period = flight.record, flight.step_interval
    nodes = np.arange(0.0, record.duration + period, period)
    shift = np.interp(record.time, nodes, period * (random.random(nodes.size) - 0.5))
    symbols = [*aircraft.control_symbols, *(["thrust"] if aircraft.throttle and flight.metered else [])]
    measured = [symbol for symbol in symbols if symbol not in flight.filled]
    return {symbol: np.interp(record.time + shift, record.time, record[symbol]) for symbol in measured}
