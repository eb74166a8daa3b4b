"""What a flight's file holds and what it is good for, before anything is identified from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.align import STEP_BACK_NS
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.csv import read_csv
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, AutopilotLog, Signal, with_outputs_of
from sysid_node.flight.logs.autopilot_log import IMU as IMU_ROLE
from sysid_node.flight.logs.checks.excitation import excitation
from sysid_node.flight.logs.checks.inputs import Inputs, inputs_of_joints, inputs_of_log
from sysid_node.flight.logs.checks.refusals import (
    Refusal,
    clock_faults,
    missing_airspeed,
    refusal_of_log,
    refusal_of_streams,
    step_back,
)
from sysid_node.flight.logs.checks.spacing import LEAST_RATE, SparseTopic, sparse_topics
from sysid_node.flight.logs.content import content_of, remapped, say_that_axes_are_known
from sysid_node.flight.logs.flown import within
from sysid_node.flight.logs.log_streams import part_remarks
from sysid_node.flight.logs.opening import is_table, read_autopilot_log
from sysid_node.flight.logs.rates import SampleRate, rate_of, rates_of_log, rates_of_streams
from sysid_node.flight.logs.record_streams import incomplete_streams, missing_columns
from sysid_node.flight.record import FlightRecord
from sysid_node.flight.streams import COMMAND_FRACTIONS, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

#: A gap is a step between samples of more than this many usual ones, and of more than 0.1 s.
_GAP_STEPS, _GAP = 3.0, 0.1

#: Parts of a flight are not connected over a longer step than this, s.
_INTERRUPTION = 0.5

#: The rate of an axis, and the length with which the airspeed makes it non-dimensional.
_LENGTHS = MappingProxyType({"roll": ("p", "b"), "pitch": ("q", "cbar"), "yaw": ("r", "b")})

#: Keys of the aircraft file that a flight needs.
OUTPUTS, FULL_DEFLECTION = "outputs", "full_deflection"


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
    above: bool = False  # the rate must be above ``needed``, as most of the IMU's messages are left out at this one

    @property
    def verdict(self) -> str:
        """Whether it can be used, in a few words."""
        if self.above:
            return f"over {self.needed:g} Hz needed"
        if self.rate < 0.93 * self.needed:
            return f"{self.needed:g} Hz needed" if self.rate else "missing"
        return "unusable" if self.fault else "ok"


@dataclass(frozen=True)
class LogSurvey:
    """What was found in a flight's file.

    ``refusal`` is why no command takes it, ``sparse`` why none does with the usual ``max_gap``, and ``two_clocks`` why
    those do not that align it as a whole. ``incomplete``
    are columns that a table lacks, of which the gap needs those of the longitudinal motion alone, but all their
    samples: ``gap_lacks``. ``needs`` are the keys that the aircraft file must state.
    """

    name: str
    kind: str
    seconds: float  # of the part that is used
    uninterrupted: float  # s, the longest part of it
    rows: tuple[SurveyRow, ...]
    excitation: Mapping[str, str]  # by axis
    angles: tuple[str, ...]  # of "alpha" and "beta", those that were measured
    refusal: Refusal
    sparse: str
    two_clocks: str
    incomplete: str
    gap_lacks: tuple[str, ...]
    needs: tuple[str, ...]
    remarks: tuple[str, ...]
    remedies: tuple[str, ...]  # settings of the autopilot to change


@dataclass(frozen=True)
class _Signals:
    """The signals of a flight in the part that is used, with what keeps each from being used."""

    imu: Signal
    airspeed: Signal
    inputs: Inputs
    others: Mapping[str, Signal]  # attitude, air density, vanes
    rates: Mapping[str, SampleRate]
    faults: Mapping[str, str]
    refusal: Refusal
    back: Mapping[str, float] = field(default_factory=dict)  # s by which a topic's clock was set back, by topic
    sparse: Mapping[str, SparseTopic] = field(default_factory=dict)  # topics that come too seldom, by source
    two_clocks: str = ""
    incomplete: str = ""
    gap_lacks: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    remedies: Mapping[str, str] = field(default_factory=dict)  # by role

    @property
    def needed(self) -> dict[str, tuple[str, str, Signal]]:
        """What no flight can do without, by topic: its name in the table, its role, and its samples."""
        return {
            IMU: ("IMU", IMU_ROLE, self.imu),
            AIR_DATA: ("airspeed", AIRSPEED, self.airspeed),
            ACTUATORS: ("controls", CONTROLS, self.inputs.commands.signal),
        }


def survey(
    path: str | Path,
    aircraft: Aircraft | None = None,
    topics: Mapping[str, str] | None = None,
    frame: BodyFrame = "flu",
) -> LogSurvey:
    """What a flight's file holds, for an ``aircraft`` where it is given. Raises InputError where it cannot be read.

    ``topics`` and ``frame`` are for bags of our own topics, as of ``open_streams``.
    """
    path = Path(path)
    other_topics = remapped(path, topics)
    log = None if other_topics else read_autopilot_log(path)
    if log is not None:
        say_that_axes_are_known(path, frame, f"log of {log.autopilot}")
        return _surveyed(path.name, log.autopilot, _of_log(log, aircraft), aircraft)
    if is_table(path, topics, frame):
        record = read_csv(path)
        found = _of_streams(incomplete_streams(record), None)  # whose joints are the controls
        found = replace(found, incomplete=missing_columns(record), gap_lacks=_not_whole(record))
    else:
        found = _of_streams(read_streams(path, topics, frame), aircraft)
    return _surveyed(path.name, content_of(path).value, found, aircraft)


def _not_whole(record: FlightRecord) -> tuple[str, ...]:
    """What ``sysid gap`` lacks in a table; from the lateral motion, too, the angle of attack can be inferred."""
    whole = {name for name in ("ax", "ay", "az", "p", "q", "r", "V", "alpha", "rho") if np.isfinite(record[name]).all()}
    inferred = {"alpha"} if {"ay", "p", "r"} <= whole and not record.measured("alpha") else set()
    return tuple(name for name in ("ax", "az", "q", "V", "alpha", "rho") if name not in whole | inferred)


def _of_log(log: AutopilotLog, aircraft: Aircraft | None) -> _Signals:
    raw = bool(aircraft.outputs) if aircraft is not None else False
    log = with_outputs_of(log, aircraft.outputs) if aircraft is not None else log
    set_back = clock_faults(log, raw_outputs=raw)
    spans = None if set_back else log.flown or None  # no time of a clock that was set tells when it flew

    def flown(signal: Signal) -> Signal:
        return signal.selected(within(spans, signal.stamp_ns))

    refusal, needs = refusal_of_log(log, raw_outputs=raw), [FULL_DEFLECTION]
    if aircraft is None and refusal.reasons:
        with_outputs = refusal_of_log(log, raw_outputs=True)
        refusal, needs = (refusal, []) if with_outputs.reasons else (with_outputs, [OUTPUTS])
    grounded = log.flown is not None and not log.flown
    faults = {IMU: "never flew as a fixed wing"} if grounded else {AIR_DATA: missing_airspeed(log)}
    roles = {IMU_ROLE: IMU, AIRSPEED: AIR_DATA, CONTROLS: ACTUATORS}
    faults |= {roles[role]: fault for role, fault in set_back.items()}
    whole = {IMU: log.imu, AIR_DATA: log.airspeed, ACTUATORS: (log.outputs if raw else log.controls).signal}
    others = {"attitude": flown(log.attitude), "air density": flown(log.density)}
    if log.vanes is not None:
        others["vanes"] = flown(log.vanes)
    return _Signals(
        flown(log.imu),
        flown(log.airspeed),
        inputs_of_log(log, aircraft),
        others,
        rates_of_log(replace(log, flown=spans), raw_outputs=raw),
        faults,
        refusal,
        back={topic: step_back(signal.stamp_ns) for topic, signal in whole.items()},
        needs=tuple(needs),
        remarks=(*part_remarks(log), *(remark for remark in log.remarks if len(log.imu))),
        remedies=log.remedies,
    )


def _of_streams(streams: Streams, aircraft: Aircraft | None) -> _Signals:
    refusal, rates = refusal_of_streams(streams), rates_of_streams(streams)
    air, imu, joints = streams.air_data, streams.imu, streams.actuators
    slow = {topic: found.fault for topic, found in rates.items() if found.fault}
    sparse = sparse_topics(streams)
    if not joints.content:  # then no rate is too low to be taken, where values can be interpolated
        rates = {topic: found._replace(needed=0.0) for topic, found in rates.items()}
    remarks = [] if joints.content else [f"{text} of an autopilot's log" for t, text in slow.items() if t not in sparse]
    remarks += [found.text for found in sparse.values() if found.left_out < 1.0]
    others = {"vanes": Signal(rates[AIR_DATA].source, air.arrival.stamp_ns, air.values[:, 1:3])}
    if not np.isfinite(air.values[:, 1:3]).any():
        others = {}
    others["attitude"] = Signal(rates[IMU].source, imu.arrival.stamp_ns, imu.attitude)
    others["air density"] = Signal(rates[AIR_DATA].source, air.arrival.stamp_ns, air.values[:, 3:])
    back = {topic: step_back(stream.arrival.stamp_ns) for topic, stream in streams.by_topic.items()}
    set_back = {topic: seconds for topic, seconds in back.items() if seconds > STEP_BACK_NS / 1e9}
    return _Signals(
        Signal(rates[IMU].source, imu.arrival.stamp_ns, imu.values),
        Signal(rates[AIR_DATA].source, air.arrival.stamp_ns, air.values[:, :1]),
        inputs_of_joints(joints, aircraft),
        others,
        rates,
        {},
        refusal,
        back,
        sparse={rates[topic].source: found for topic, found in sparse.items()},
        two_clocks=next(
            (f"the stamps of {t} go back by {s:.1f} s; cut the recording there" for t, s in set_back.items()), ""
        ),
        needs=(FULL_DEFLECTION,) if joints.content == COMMAND_FRACTIONS else (),
        remarks=tuple(remarks),
    )


def _surveyed(name: str, kind: str, signals: _Signals, aircraft: Aircraft | None) -> LogSurvey:
    rows, to_change = [], []
    for topic, (shown, role, signal) in signals.needed.items():
        clock = _clock(signal, signals.back[topic])
        rows.append(_row(shown, signal, signals.rates[topic], clock, signals.faults.get(topic, "")))
        if role in signals.remedies and (not len(signal) or signals.rates[topic].fault):
            to_change.append(signals.remedies[role])
    for shown, signal in signals.others.items():
        missing = "" if np.isfinite(signal.values).any() else "none"
        rows.append(
            _row(shown, signal, SampleRate(signal.source, rate_of(signal.stamp_ns), 0.0, ""), _clock(signal), missing)
        )
    rows = [replace(row, needed=LEAST_RATE, above=True) if row.source in signals.sparse else row for row in rows]
    stamps = signals.imu.stamp_ns
    vanes = signals.others.get("vanes")
    return LogSurvey(
        name,
        kind,
        float(stamps.max() - stamps.min()) / 1e9 if stamps.size else 0.0,
        _uninterrupted(signals),
        tuple(rows),
        excitation_in_words(signals.imu, signals.airspeed, signals.inputs, aircraft),
        tuple(name for i, name in enumerate(("alpha", "beta")) if vanes is not None and _measured(vanes, i)),
        signals.refusal,
        "; ".join(found.text for found in signals.sparse.values() if found.left_out == 1.0),
        signals.two_clocks,
        signals.incomplete,
        signals.gap_lacks,
        signals.needs,
        signals.remarks,
        tuple(dict.fromkeys(to_change)),
    )


def _measured(signal: Signal, column: int) -> bool:
    return bool(np.isfinite(signal.values[:, column]).any())


def _row(shown: str, signal: Signal, found: SampleRate, clock: str, fault: str) -> SurveyRow:
    if not len(signal):
        fault = fault or f"no {signal.source} in it"
    return SurveyRow(shown, signal.source, found.rate, found.needed, _gaps(signal), clock, fault or found.fault)


def _gaps(signal: Signal) -> str:
    steps = np.diff(signal.stamp_ns) / 1e9
    usual = float(np.median(steps)) if steps.size else 0.0
    long = steps[steps > max(_GAP_STEPS * usual, _GAP)]
    return f"{long.size}, longest {long.max():.2f} s" if long.size else "none"


def _clock(signal: Signal, back: float = 0.0) -> str:
    """Faults of a signal's clock, which was set back by ``back`` s before the part that is used was chosen."""
    back = max(back, step_back(signal.stamp_ns))
    if back > STEP_BACK_NS / 1e9:
        return f"goes back by {back:.1f} s"
    odd = int(np.count_nonzero(np.diff(signal.stamp_ns) <= 0))
    return f"{odd} stamps repeated or late" if odd else "good"


def _uninterrupted(signals: _Signals) -> float:
    """The longest time (s) in which IMU, airspeed and controls came without an interruption."""
    needed = [np.unique(signal.stamp_ns[signal.stamp_ns > 0]) for _, _, signal in signals.needed.values()]
    if any(stamps.size < 2 for stamps in needed):
        return 0.0
    begin, end = max(int(stamps[0]) for stamps in needed), min(int(stamps[-1]) for stamps in needed)
    gaps = [(begin, begin), (end, end)]
    for stamps in needed:
        steps = np.diff(stamps)
        longest = max(_INTERRUPTION * 1e9, 1.5 * float(np.median(steps)))
        gaps += [(int(stamps[i]), int(stamps[i + 1])) for i in np.flatnonzero(steps > longest)]
    longest_part, until = 0, begin
    for first, last in sorted(gaps):
        longest_part, until = max(longest_part, min(first, end) - until), max(until, last)
    return longest_part / 1e9


def excitation_in_words(imu: Signal, airspeed: Signal, inputs: Inputs, aircraft: Aircraft | None) -> dict[str, str]:
    """By axis, how well it was excited, its angular rate and the input that moved it, as root mean squares."""
    speeds = airspeed.values[np.isfinite(airspeed.values)]
    speed = float(np.mean(speeds)) if speeds.size else 0.0
    texts = {}
    for axis, found in excitation(imu, inputs.commands).items():
        text = f"{found.word}, {np.degrees(found.rate):.1f} deg/s"
        if aircraft is not None and speed > 0.0:
            symbol, length = _LENGTHS[axis]
            size = aircraft.geometry.b if length == "b" else aircraft.geometry.cbar
            text += f" ({symbol} {length}/2V {found.rate * size / (2.0 * speed):.2g})"
        if found.control:
            text += f" by {inputs.spread(found.deflection)}{found.control}"
            shows = f"to which the response is known within {100.0 * found.error:.2g} %"
            text += f", {shows}" if found.error < 1.0 else ", to which no response shows"
        texts[axis] = text
    return texts
