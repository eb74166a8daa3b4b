"""A flight as a diagnosis takes it: loaded, completed where signals are missing, and resampled to one time base."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import flight_record
from sysid_node.flight.csv import read_csv
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.live.mean_force import checked_force
from sysid_node.flight.live.mean_lift import mean_lift
from sysid_node.flight.live.reading_signs import checked_signs
from sysid_node.flight.live.unchanging import changing_readings
from sysid_node.flight.logs.opening import is_table, open_streams
from sysid_node.flight.record import (
    USUAL_STEPS,
    Array,
    FlightRecord,
    interrupted_in_words,
    lacking_in_words,
    rows_with_values,
    uninterrupted_parts,
)
from sysid_node.flight.streams import Streams
from sysid_node.gap.flightdata.flow_angles import FilterHistory, missing_flow_angles, run_flow_angle_filter
from sysid_node.gap.flightdata.thrust import thrust_missing, with_inferred_thrust
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim.prediction.signals import unfiltered_columns
from sysid_node.sim.signals.low_pass import gaussian_taps, low_passed

#: Rate at which the forces of a small aircraft are predicted, Hz: more than ten times the highest frequency that is
#: compared. A heavier one needs fewer (``time_scales.analysis_rate``).
ANALYSIS_RATE = 50.0

#: Shortest flight that can be diagnosed, s: three windows of at least a short period each.
SHORTEST_FLIGHT = 6.0

_INTERRUPTION = 0.2  # s: no signal is interpolated across a longer step

_LATERAL = ("ay", "p", "r", "beta")
_NEEDED = ("ax", "az", "q", "V", "alpha", "rho", "thrust", *_LATERAL)


@dataclass(frozen=True)
class GapFlight:
    """A record, and the rate at which each topic was sampled, Hz, from which the noise in the band follows.

    ``command_interval`` (s) is that of a log's commands where lines stand between them (``JointStream``); their
    ``actuator_rate`` is then that of the lines.
    """

    record: FlightRecord
    imu_rate: float
    air_rate: float
    actuator_rate: float
    lateral: bool = True  # whether side force, roll and yaw were measured
    source: str = ""
    filled: tuple[str, ...] = field(default=())  # columns that were not measured and are taken as zero
    inferred: tuple[str, ...] = field(default=())  # flow angles that no vane measured
    history: FilterHistory | None = None  # how they were inferred
    left_out: float = 0.0  # s without a manoeuvre that were cut off
    metered: bool = True  # whether thrust was measured; else it is inferred from the file's drag
    command_interval: float = 0.0
    begin: float = 0.0  # s of the recording at which the record's time is zero

    @property
    def step_interval(self) -> float:
        """Time within which a step in the commands may have fallen, s."""
        return self.command_interval or 1.0 / self.actuator_rate


def load_gap_flights(
    path: Path,
    aircraft: Aircraft,
    topics: Mapping[str, str] | None,
    frame: BodyFrame,
    carried: str = "auto",
) -> list[GapFlight]:
    """The flight of a bag or a log, in parts where its recording was interrupted (``completed_flights``).

    ``carried``: what the actuators' messages are, as of ``flight_record``. Raises InputError where the flight is
    unreadable, lacks a signal or is too short.
    """
    if is_table(path, topics, frame):
        record = _checked(aircraft, read_csv(path, aircraft.control_symbols))
        rate = 1.0 / float(np.median(np.diff(record.time)))
        return completed_flights(aircraft, GapFlight(record, rate, rate, rate, source=str(path)))
    return flights_of_streams(open_streams(path, aircraft, topics, frame), aircraft, str(path), carried)


def flights_of_streams(
    streams: Streams, aircraft: Aircraft, source: str = "", carried: str = "auto"
) -> list[GapFlight]:
    """The flight of recorded messages, as ``load_gap_flights`` gives it.

    Raises InputError where it lacks a signal or is too short.
    """
    Actuation.of(aircraft).require(streams.actuators.names, streams.name)
    # commands are held, but the servos are the simulator's own
    record = _checked(aircraft, flight_record(aircraft, streams, 0.2, carried, servos=False))
    rates = [1e9 / float(np.median(np.diff(s.arrival.stamp_ns))) for s in streams.by_topic.values()]
    flight = GapFlight(record, rates[0], rates[1], rates[2], source=source)
    return completed_flights(aircraft, replace(flight, command_interval=streams.actuators.interval))


def _checked(aircraft: Aircraft, record: FlightRecord) -> FlightRecord:
    """The record as it is. Raises InputError and warns where its readings cannot be those of a flight."""
    opposite_alpha = mean_lift(aircraft, record).opposite_alpha
    return changing_readings(aircraft, checked_signs(checked_force(record), opposite_alpha=opposite_alpha))


def completed_flights(aircraft: Aircraft, flight: GapFlight) -> list[GapFlight]:
    """The flight, in parts where its recording was interrupted, with what was not measured.

    Lateral signals that were not measured are zeros, flow angles and thrust are inferred. Samples that lack a value of
    a signal are left out. So are parts that are too short, and parts in which no surface moves, unless that holds for
    all; warns (InputWarning) of what is left out. Raises InputError where a signal is missing that cannot be inferred,
    or where the flight is too short.
    """
    record = _complete(aircraft, flight.record, flight.source)
    parts = [_part(flight, record, rows) for rows in uninterrupted_parts(record.time, _INTERRUPTION)]
    if len(parts) > 1:
        parts = _usable(aircraft, parts, record.duration)
    return [_with_thrust(aircraft, _with_lateral(aircraft, _with_flow_angles(aircraft, part))) for part in parts]


def longest(flights: Sequence[GapFlight]) -> GapFlight:
    """The longest of flights, or of the parts of one."""
    return max(flights, key=lambda flight: flight.record.duration)


def _usable(aircraft: Aircraft, parts: list[GapFlight], duration: float) -> list[GapFlight]:
    """The parts of an interrupted flight of so many s that can be diagnosed, else the longest; warns of the others."""
    kept = [p for p in parts if p.record.duration >= SHORTEST_FLIGHT and _surface_moves(aircraft, p.record)]
    kept = kept or [longest(parts)]
    seconds = sum(part.record.duration for part in kept)
    warnings.warn(
        f"{kept[0].source}: {interrupted_in_words(len(parts))} for more than {_INTERRUPTION:g} s; the gap is measured "
        f"on {_which(len(kept), len(parts))}, {seconds:.3g} of {duration:.3g} s",
        InputWarning,
        stacklevel=2,
    )
    return kept


def _which(kept: int, parts: int) -> str:
    """Which of an interrupted flight's parts are used, in words."""
    if kept == parts:
        return f"its {parts} parts"
    used = f"{kept} of its {parts} parts" if kept > 1 else "one part"
    return f"{used} (the others are shorter than {SHORTEST_FLIGHT:g} s, or no surface moves in them)"


def _part(flight: GapFlight, record: FlightRecord, rows: slice) -> GapFlight:
    """These rows of the flight's record; the part's own time begins at zero."""
    time, first = record.time[rows], float(record.time[rows][0])
    columns = {name: values[rows] for name, values in record.columns.items()}
    start = record.start_ns + round(1e9 * first)
    part = FlightRecord(time - first, columns, record.name, start, record.rejected, record.commanded)
    return replace(flight, record=part, begin=flight.begin + first - float(record.time[0]))


def _surface_moves(aircraft: Aircraft, record: FlightRecord) -> bool:
    """Whether a control surface moves as much as a diagnosis needs."""
    deflections = np.column_stack([record[name] for name in aircraft.control_symbols])
    return bool((travel(deflections) >= THRESHOLDS.admission.least_travel).any())


def travel(deflections: Array) -> Array:
    """Travel (...,) of controls (N, ...), rad, without single outliers; NaN where values are missing."""
    return np.asarray(np.ptp(np.percentile(deflections, [0.5, 99.5], axis=0), axis=0))


def _complete(aircraft: Aircraft, record: FlightRecord, source: str) -> FlightRecord:
    """The record without the samples that lack a value, where these are at most half; warns (InputWarning) of them."""
    complete, names = rows_with_values(record, [*_NEEDED, *aircraft.control_symbols])
    if not names or 2 * int(complete.sum()) < len(record):
        return record
    warnings.warn(f"{source}: {lacking_in_words(complete, names)}, and are left out", InputWarning, stacklevel=2)
    columns = {name: values[complete] for name, values in record.columns.items()}
    return replace(record, time=record.time[complete], columns=columns)


def _with_lateral(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with zeros for the lateral signals where not all of them were measured."""
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
            f"{flight.source}: {record.duration:.1f} s of flight without interruption; the gap needs "
            f"{SHORTEST_FLIGHT:g} s or more"
        )
    if lateral:
        return replace(flight, record=record)
    filled = (*(n for n in _LATERAL if not np.isfinite(record[n]).all()), *fillable)
    columns = {**record.columns, **{name: np.zeros(len(record)) for name in filled}}
    return replace(flight, record=replace(record, columns=columns), lateral=False, filled=filled)


def _with_thrust(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with an inferred thrust, where the aircraft has an engine whose thrust was not measured."""
    if not thrust_missing(aircraft, flight.record):
        return flight
    return replace(flight, record=with_inferred_thrust(aircraft, flight.record), metered=False)


def _with_flow_angles(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with inferred flow angles, where no vane measured them and the inertial measurements are complete."""
    angles = missing_flow_angles(flight.record)
    if not angles or not all(np.isfinite(flight.record[name]).all() for name in ("ay", "p", "r")):
        return flight
    return with_inferred_angles(aircraft, replace(flight, inferred=angles))


def with_inferred_angles(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with the flow angles inferred that nobody measured."""
    if not flight.inferred:
        return flight
    record, history = run_flow_angle_filter(aircraft, flight.record, flight.inferred, flight.source)
    return replace(flight, record=record, history=history)


def with_inferred_signals(aircraft: Aircraft, flight: GapFlight) -> GapFlight:
    """The flight with its flow angles and thrust inferred anew where nobody measured them."""
    flight = with_inferred_angles(aircraft, flight)
    if flight.metered:
        return flight
    return replace(flight, record=with_inferred_thrust(aircraft, flight.record))


def resampled(flight: GapFlight, rate: float = ANALYSIS_RATE) -> FlightRecord:
    """The flight at ``rate``, Hz, low-passed with zero phase, with angular accelerations.

    Columns ``p_rate q_rate r_rate`` (rad/s^2) are fourth-order central differences of the rates before the low-pass.
    Commands are also kept as they were before it, in the columns of ``unfiltered_columns``.
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
    taps = gaussian_taps(rate * factor, rate)
    low = {name: low_passed(values, taps)[::factor] for name, values in columns.items()}
    for name in columns.keys() - _SMOOTH - _TURNING - {f"{rate_name}_rate" for rate_name in "pqr"}:
        low |= _unfiltered(record, name, fine[::factor], 1.0 / rate)
    return FlightRecord(fine[::factor], low, record.name, record.start_ns)


def _unfiltered(record: FlightRecord, name: str, time: Array, step: float) -> dict[str, Array]:
    """A command at the times (s) of the samples and between them, before the low-pass."""
    parts = unfiltered_columns(name)
    return {part: np.interp(time + step * i / len(parts), record.time, record[name]) for i, part in enumerate(parts)}


#: Columns that are interpolated by a cubic spline; the others (commands) are interpolated linearly.
_SMOOTH = frozenset({"ax", "ay", "az", "p", "q", "r", "V", "alpha", "beta", "rho", "phi", "theta"})

#: Angles that jump by a full turn and are unwrapped before the low-pass.
_TURNING = frozenset({"phi", "psi"})


def _on_grid(time: Array, values: Array, grid: Array, *, smooth: bool) -> Array:
    """A series interpolated to the times of a grid, s; linearly where samples are missing.

    There a spline would go far astray, because it continues the slope that two noisy samples have.
    """
    linear: Array = np.interp(grid, time, values)
    if not smooth:
        return linear
    steps = np.diff(time)
    missing = steps > USUAL_STEPS * float(np.median(steps))
    before = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, steps.size - 1)
    return np.where(missing[before], linear, CubicSpline(time, values)(grid))


def _slope(values: Array, rate: float) -> Array:
    """Time derivative (N,) by fourth-order central differences; at the ends the nearest inner value."""
    inner = (8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) * rate / 12.0
    return np.concatenate([inner[:1], inner[:1], inner, inner[-1:], inner[-1:]])
