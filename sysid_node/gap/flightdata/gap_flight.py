"""Flights made ready for comparison: one low-passed, regular time base for what was measured and commanded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import fftconvolve, firwin

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import flight_record
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.logs import READERS, read_log
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata import flow_angles as inferred
from sysid_node.gap.flightdata.thrust import thrust_missing, with_inferred_thrust

#: Rate at which forces are predicted (Hz): six times the highest line that is compared, and more.
ANALYSIS_RATE = 50.0

#: Corner of the zero-phase low-pass before samples are thinned to ``RATE``, Hz. Flat to 6 Hz; commands pass it too,
#: so that a linear chain is compared with itself.
_CORNER = 11.0

#: Shortest flight that can be compared, s: three windows that hold a short period each.
SHORTEST_FLIGHT = 6.0

_LATERAL = ("ay", "p", "r", "beta")


@dataclass(frozen=True)
class GapFlight:
    """A record, and how often each topic was sampled (Hz), which says how much noise lies in the band."""

    record: FlightRecord
    imu_rate: float
    air_rate: float
    actuator_rate: float
    lateral: bool = True  # whether side force, roll and yaw were measured
    source: str = ""
    filled: tuple[str, ...] = field(default=())  # columns that were not measured and are taken as zero
    inferred: tuple[str, ...] = field(default=())  # flow angles that no vane measured
    left_out: float = 0.0  # s without a manoeuvre that are not looked at
    metered: bool = True  # whether thrust is known, or else is what the file's drag leaves of the forward force


def load_gap_flight(path: Path, aircraft: Aircraft, topics: Mapping[str, str] | None, frame: BodyFrame) -> GapFlight:
    """A flight of a bag or a log. Raises InputError: unreadable, lacking a signal, too short."""
    if path.suffix.lower() in READERS:
        record = read_log(path)
        rate = 1.0 / float(np.median(np.diff(record.time)))
        return completed_flight(aircraft, GapFlight(record, rate, rate, rate, source=str(path)))
    streams = read_streams(path, topics, frame)
    Actuation.of(aircraft).require(streams.actuators.names, streams.name)
    record = flight_record(aircraft, streams, 0.2)
    rates = [1e9 / float(np.median(np.diff(s.arrival.stamp_ns))) for s in streams.by_topic.values()]
    return completed_flight(aircraft, GapFlight(record, rates[0], rates[1], rates[2], source=str(path)))


def completed_flight(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with the lateral signals, where all are absent, as zeros, and a thrust where nobody metered it.

    Raises InputError where a signal is missing.
    """
    flight = _with_flow_angles(aircraft, replace(flight, record=_first_run(flight.record)))
    return _with_thrust(aircraft, _with_lateral(aircraft, flight))


def _with_lateral(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    record = flight.record
    longitudinal = ("ax", "az", "q", "V", "alpha", "rho", *aircraft.control_symbols)
    needed = [*longitudinal, *(["thrust"] if aircraft.throttle and record.measured("thrust") else [])]
    lateral = all(np.isfinite(record[name]).all() for name in _LATERAL)
    absent = [name for name in needed if not np.isfinite(record[name]).all()]
    fillable = [name for name in absent if name in {"da", "dr"} and not lateral]
    missing = [name for name in absent if name not in fillable]
    if missing:
        raise InputError(f"{flight.source}: no complete {', '.join(missing)}; the gap cannot be measured without")
    if record.duration < SHORTEST_FLIGHT:
        raise InputError(
            f"{flight.source}: {record.duration:.1f} s of flight; the gap needs {SHORTEST_FLIGHT:g} s or more"
        )
    if lateral:
        return replace(flight, record=record)
    filled = (*(n for n in _LATERAL if not np.isfinite(record[n]).all()), *fillable)
    columns = {**record.columns, **{name: np.zeros(len(record)) for name in filled}}
    return replace(flight, record=replace(record, columns=columns), lateral=False, filled=filled)


def _with_thrust(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with a thrust that keeps its airspeed, where the aircraft has an engine that nobody metered."""
    if not thrust_missing(aircraft, flight.record):
        return flight
    return replace(flight, record=with_inferred_thrust(aircraft, flight.record), metered=False)


def _with_flow_angles(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with the flow angles that its aircraft has no vane for, where the six inertial instruments tell."""
    angles = inferred.missing_flow_angles(flight.record)
    if not angles or not all(np.isfinite(flight.record[name]).all() for name in ("ay", "p", "r")):
        return flight
    return replace(
        flight, record=inferred.with_inferred_angles(aircraft, flight.record, angles, flight.source), inferred=angles
    )


def _first_run(record: FlightRecord) -> FlightRecord:
    """The longest part without a gap in time of more than half a second."""
    breaks = np.flatnonzero(np.diff(record.time) > 0.5)
    edges = np.concatenate([[0], breaks + 1, [len(record)]])
    longest = int(np.argmax(np.diff(edges)))
    keep = slice(int(edges[longest]), int(edges[longest + 1]))
    columns = {name: values[keep] for name, values in record.columns.items()}
    time = record.time[keep] - record.time[keep][0]
    return FlightRecord(time, columns, record.name, record.start_ns, record.rejected)


def resampled(flight: GapFlight, rate: float = ANALYSIS_RATE) -> FlightRecord:
    """The flight at ``rate``, low-passed with zero phase, and the gyroscopes' rates of change added.

    Columns ``p_rate q_rate r_rate`` (rad/s^2) are fourth-order central differences before the low-pass.
    """
    record = flight.record
    factor = max(1, round(flight.imu_rate / rate))
    fine = np.arange(int(record.duration * rate * factor + 1e-9) + 1) / (rate * factor)
    columns = {}
    for name, values in record.columns.items():
        if np.isfinite(values).all():
            whole = np.unwrap(values) if name in _TURNING else values
            columns[name] = _on_grid(record.time, whole, fine, smooth=name in _SMOOTH)
    for name in ("p", "q", "r"):
        columns[f"{name}_rate"] = _slope(columns[name], rate * factor)
    taps = _low_pass(rate * factor)
    low = {name: _filtered(values, taps)[::factor] for name, values in columns.items()}
    return FlightRecord(fine[::factor], low, record.name, record.start_ns)


#: Columns of motion; the others (commands) are straight between samples.
_SMOOTH = frozenset({"ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta", "rho", "phi", "theta"})

#: Angles that jump by a full turn, which no low-pass should see.
_TURNING = frozenset({"phi", "psi"})


def _on_grid(time: Array, values: Array, grid: Array, *, smooth: bool) -> Array:
    between: Array = CubicSpline(time, values)(grid) if smooth else np.interp(grid, time, values)
    return between


def _slope(values: Array, rate: float) -> Array:
    """d/dt (N,) by fourth-order central differences; the ends repeat the inner values."""
    inner = (8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) * rate / 12.0
    return np.concatenate([inner[:1], inner[:1], inner, inner[-1:], inner[-1:]])


def _low_pass(rate: float) -> Array:
    """Taps of the linear-phase low-pass, a quarter of a second each way; one tap where the rate is too low for it."""
    if rate <= 2.2 * _CORNER:
        return np.ones(1)
    taps: Array = firwin(2 * round(0.25 * rate) + 1, _CORNER, fs=rate)
    return taps


def _filtered(values: Array, taps: Array) -> Array:
    half = taps.size // 2
    padded = np.pad(values, half, mode="edge")
    low: Array = fftconvolve(padded, taps, mode="valid")
    return low
