"""What a flight's file holds and what it is good for, before anything is identified from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from sysid_node.flight.align import STEP_BACK_NS
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.csv import read_csv
from sysid_node.flight.logs.autopilot_log import AutopilotLog, LoggedCommands, Signal
from sysid_node.flight.logs.content import content_of
from sysid_node.flight.logs.flown import within
from sysid_node.flight.logs.log_streams import missing_airspeed, part_remarks
from sysid_node.flight.logs.opening import is_table, read_autopilot_log
from sysid_node.flight.logs.rates import SampleRate, rate_of, rates_of_log, rates_of_streams
from sysid_node.flight.logs.record_streams import streams_from_record
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

#: Shortest part in the air that can be used, s: three windows of at least a short period each.
SHORTEST = 6.0

#: A gap is a step between samples of more than this many usual ones, and of more than 0.1 s.
_GAP_STEPS, _GAP = 3.0, 0.1

#: Angular rates (deg/s, root mean square) below which an axis is hardly and weakly excited.
_HARDLY, _WEAKLY = 2.0, 5.0

_AXES = MappingProxyType({"roll": (3, "aileron"), "pitch": (4, "elevator"), "yaw": (5, "rudder")})


@dataclass(frozen=True)
class SurveyRow:
    """A signal: where it is from, its rate (Hz), gaps and faults of its clock, and why it cannot be used."""

    signal: str
    source: str
    rate: float
    needed: float  # Hz; 0: any rate will do
    gaps: str
    clock: str
    fault: str

    @property
    def verdict(self) -> str:
        """Whether it can be used, in two words."""
        if self.rate < 0.93 * self.needed:
            return f"{self.needed:g} Hz needed" if self.rate else "missing"
        return "unusable" if self.fault else "ok"


@dataclass(frozen=True)
class LogSurvey:
    """What was found in a flight's file."""

    name: str
    kind: str
    seconds: float  # of the part that is used
    rows: tuple[SurveyRow, ...]
    excitation: Mapping[str, str]  # by axis
    good_for: Mapping[str, str]  # command -> "yes", or why not
    remarks: tuple[str, ...]
    remedies: tuple[str, ...]  # settings of the autopilot to change


@dataclass(frozen=True)
class _Signals:
    """The signals of a flight in the part that is used, with what keeps each from being used."""

    imu: Signal
    airspeed: Signal
    commands: LoggedCommands
    others: Mapping[str, Signal]  # attitude, air density, vanes
    rates: Mapping[str, SampleRate]
    faults: Mapping[str, str]
    in_radians: bool  # the commands are deflections, not fractions of the full command


def survey(path: str | Path) -> LogSurvey:
    """What a flight's file holds. Raises InputError where it cannot be read at all."""
    path = Path(path)
    log = read_autopilot_log(path)
    if log is None:
        streams = streams_from_record(read_csv(path)) if is_table(path) else read_streams(path)
        return _surveyed(path.name, content_of(path).value, _of_streams(streams), (), {})
    remarks = (*part_remarks(log), *(remark for remark in log.remarks if len(log.imu)))
    return _surveyed(path.name, log.autopilot, _of_log(log), remarks, log.remedies)


def _of_log(log: AutopilotLog) -> _Signals:
    commands = log.controls if log.controls.names else log.outputs
    rates = rates_of_log(log)

    def flown(signal: Signal) -> Signal:
        return signal.selected(within(log.flown or None, signal.stamp_ns))

    grounded = log.flown is not None and not log.flown
    faults = {IMU: "never flew as a fixed wing"} if grounded else {AIR_DATA: missing_airspeed(log)}
    others = {"attitude": flown(log.attitude), "air density": flown(log.density)}
    if log.vanes is not None:
        others["vanes"] = flown(log.vanes)
    shown = commands if log.controls.names else replace(commands, names=())
    signals = replace(shown, signal=flown(commands.signal))
    return _Signals(flown(log.imu), flown(log.airspeed), signals, others, rates, faults, in_radians=False)


def _of_streams(streams: Streams) -> _Signals:
    rates = rates_of_streams(streams)
    air, joints = streams.air_data, streams.actuators
    others = {"vanes": Signal(rates[AIR_DATA].source, air.arrival.stamp_ns, air.values[:, 1:3])}
    if not np.isfinite(air.values[:, 1:3]).any():
        others = {}
    others["attitude"] = Signal(rates[IMU].source, streams.imu.arrival.stamp_ns, streams.imu.attitude)
    others["air density"] = Signal(rates[AIR_DATA].source, air.arrival.stamp_ns, air.values[:, 3:])
    return _Signals(
        Signal(rates[IMU].source, streams.imu.arrival.stamp_ns, streams.imu.values),
        Signal(rates[AIR_DATA].source, air.arrival.stamp_ns, air.values[:, :1]),
        LoggedCommands(joints.names, Signal(rates[ACTUATORS].source, joints.arrival.stamp_ns, joints.positions)),
        others,
        rates,
        {},
        in_radians=not joints.content.endswith("fractions"),
    )


def _surveyed(
    name: str, kind: str, signals: _Signals, remarks: Sequence[str], remedies: Mapping[str, str]
) -> LogSurvey:
    needed = {
        IMU: ("IMU", signals.imu),
        AIR_DATA: ("airspeed", signals.airspeed),
        ACTUATORS: ("controls", signals.commands.signal),
    }
    rows, to_change = [], []
    for (topic, (shown, signal)), role in zip(needed.items(), ("imu", "airspeed", "controls"), strict=True):
        row = _row(shown, signal, signals.rates[topic], signals.faults.get(topic, ""))
        rows.append(row)
        if role in remedies and (not len(signal) or signals.rates[topic].fault):
            to_change.append(remedies[role])
    for shown, signal in signals.others.items():
        missing = "" if np.isfinite(signal.values).any() else "none"
        rows.append(_row(shown, signal, SampleRate(signal.source, rate_of(signal.stamp_ns), 0.0, ""), missing))
    stamps = signals.imu.stamp_ns
    seconds = float(stamps.max() - stamps.min()) / 1e9 if stamps.size else 0.0
    return LogSurvey(
        name,
        kind,
        seconds,
        tuple(rows),
        _excitation(signals),
        _good_for(rows[:3], seconds, vanes="vanes" in signals.others),
        tuple(remarks),
        tuple(dict.fromkeys(to_change)),
    )


def _row(shown: str, signal: Signal, found: SampleRate, fault: str) -> SurveyRow:
    if not len(signal):
        fault = fault or f"no {signal.source} in it"
    gaps, clock = _gaps(signal), _clock(signal)
    if not fault and clock.startswith("goes back"):
        fault = f"the clock of {signal.source} {clock}"
    return SurveyRow(shown, signal.source, found.rate, found.needed, gaps, clock, fault or found.fault)


def _gaps(signal: Signal) -> str:
    steps = np.diff(signal.stamp_ns) / 1e9
    usual = float(np.median(steps)) if steps.size else 0.0
    long = steps[steps > max(_GAP_STEPS * usual, _GAP)]
    return f"{long.size}, longest {long.max():.2f} s" if long.size else "none"


def _clock(signal: Signal) -> str:
    steps = np.diff(signal.stamp_ns)
    back = -int(steps.min(initial=0))
    if back > STEP_BACK_NS:
        return f"goes back by {back / 1e9:.1f} s"
    odd = int(np.count_nonzero(steps <= 0))
    return f"{odd} stamps repeated or late" if odd else "good"


def _excitation(signals: _Signals) -> dict[str, str]:
    """By axis, the angular rate and the deflection that moved it, as root mean squares about their means."""
    found = {}
    for axis, (column, control) in _AXES.items():
        rates = signals.imu.values[:, column]
        rates = rates[np.isfinite(rates)]
        turned = float(np.degrees(np.std(rates))) if rates.size else 0.0
        word = "hardly" if turned < _HARDLY else "weakly" if turned < _WEAKLY else "well"
        description = f"{word}, {turned:.1f} deg/s"
        if control in signals.commands.names:
            values = signals.commands.signal.values[:, signals.commands.names.index(control)]
            description += f" by {_spread(values, in_radians=signals.in_radians)} of {control}"
        found[axis] = description
    return found


def _spread(values: Array, *, in_radians: bool) -> str:
    spread = float(np.nanstd(values)) if np.isfinite(values).any() else 0.0
    return f"{np.degrees(spread):.1f} deg" if in_radians else f"{100.0 * spread:.1f} %"


def _good_for(needed: Sequence[SurveyRow], seconds: float, *, vanes: bool) -> dict[str, str]:
    """What each command can do with the flight: yes, or the first thing that it lacks."""
    faults = [row.fault for row in needed if row.fault]
    if seconds < SHORTEST:
        faults.append(f"{seconds:.1f} s in the air; {SHORTEST:g} s are needed")
    how = "with vanes" if vanes else "without vanes: the angle of attack and the sideslip are inferred"
    if faults:
        return {"replay, identify, gap, faults": f"no: {'; '.join(faults)}"}
    return {
        "replay, identify, gap": f"yes, {how}",
        "faults": "yes" if vanes else "yes, of surfaces and of the airframe; not of vanes",
    }
