"""A flight identified as the live node does: the same functions, message for message, in a memory that is bounded."""

from __future__ import annotations

import math
import warnings
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.opposite_estimates import opposite_estimates
from sysid_node.aircraft.stated_effects import as_estimated, not_taken_in_words
from sysid_node.api.estimated_run import EstimatedRun
from sysid_node.api.flight_file import FlightFile, flight_list
from sysid_node.errors import InputError, InputWarning, noted_warnings
from sysid_node.faults.model.reference_model import identifier_estimates
from sysid_node.faults.recorded_flight import FaultVerdict, RecordedEstimates, RecordedMonitor
from sysid_node.faults.settings import FaultMonitorSettings as FaultSettings
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import (
    counts_by_reason,
    joined_spans,
    stamp_spans,
    warn_without_density,
    why_nothing_aligned,
)
from sysid_node.flight.commanded import carried_in_words
from sysid_node.flight.logs.opening import carried_by
from sysid_node.flight.pieces import PIECE, FlightPiece, FlightPieces, flight_pieces
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps
from sysid_node.flight.truth import Truth, truth_at_end
from sysid_node.online import estimator
from sysid_node.online.alignment import flow_angle_filter, schedule
from sysid_node.online.alignment.flight_checks import FlightChecks
from sysid_node.online.alignment.in_pieces import AlignedSamples, PieceAlignment
from sysid_node.online.estimates.covariance import EstimateCovariance, estimate_covariance
from sysid_node.online.estimates.log import EstimatesLog
from sysid_node.online.estimates.published import estimate
from sysid_node.online.estimates.servo_gap import surely_late
from sysid_node.online.settings import FIRST_ESTIMATE, OnlineSettings, too_short_to_replay
from sysid_node.online.types import Estimates
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.report.files.runs.estimates_bag import write_estimates
from sysid_node.report.files.runs.run_folder import REPORT, write_aircraft, write_run
from sysid_node.report.results.from_replay import replay_result
from sysid_node.report.results.recorded_samples import RecordedSamples
from sysid_node.report.results.run_result import RunResult

PUBLISH_RATE = 20.0  # Hz, the node's default
ESTIMATES_BAG = "estimates"
TABLE_ROWS = 600  # times at which the tables and the report show estimates; the bag holds all
REPORT_EVERY = 512  # samples between reports of progress


#: Parts of the work on a piece: the shares of time at which they begin and end, and what is done.
_IDENTIFYING, _FAULTS = (0.0, 0.7, "identifying"), (0.7, 1.0, "looking for faults")

Progress = Callable[[float, str], None]


@dataclass(frozen=True, repr=False)
class Replay(EstimatedRun):
    """What a bag gave: the estimates as the live node would have published them.

    ``history`` lies on the disk and is read where it is looked at; of its estimates ``final`` alone has a budget.
    """

    aircraft: Aircraft
    settings: OnlineSettings
    publish_rate: float  # Hz
    samples: RecordedSamples
    flow: flow_angle_filter.FlowAngleFilter
    commands_from: float  # s, time of the first sample whose deflections follow from commands; inf where none do
    rejected: Mapping[str, int]  # "<topic>: <reason>" -> messages left out
    history: Sequence[Estimates]
    stamps_ns: Stamps  # (K,) header stamps at which each of ``history`` (K,) fell due
    final: Estimates  # after the last sample, whether or not one was due
    frame_id: str  # of the IMU's messages
    truth: Truth  # empty where it is not known
    covariance: EstimateCovariance | None  # of ``final``; None where nothing was estimated
    faults: FaultVerdict | None = None  # None: nothing was judged
    warnings: tuple[str, ...] = ()  # about the flight, as they were given

    @cached_property
    def run(self) -> RunResult:  # type: ignore[override]  # computed when it is first needed
        """Everything that the report shows, estimates over time thinned to what a table holds."""
        every = max(len(self.history) // TABLE_ROWS, 1)
        # While the estimator settles nothing is included yet, and estimates have the same time.
        shown = {estimates.time: estimates for estimates in (*self.history[every - 1 :: every], self.final)}
        commanded = math.isfinite(self.commands_from)
        carried = carried_in_words(self.aircraft, self.settings.actuators, commanded, surely_late(self.final.servos))
        said = (carried, not_taken_in_words(self.aircraft))
        result = replay_result(
            self.aircraft,
            self.settings,
            recorded=self.samples,
            history=list(shown.values()),
            rejected=self.rejected,
            truth=self.truth.values,
            truth_since=self.truth.since,
            faults=self.faults,
            commanded=commanded,
            remarks=[*self.warnings, *flow_angle_filter.remarks(self.flow), *filter(None, said)],
        )
        publishing = {"publish_rate": self.publish_rate, "actuators_carry": "commands" if commanded else "positions"}
        return replace(result, settings={**result.settings, **publishing})

    def save(self, folder: str | Path, *, force: bool = False) -> Path:
        """Write what ``sysid replay`` writes; returns the path of the report.

        What an earlier replay left in the folder is replaced. Raises InputError where the folder holds anything else
        and ``force`` is not given, or cannot be written.
        """
        with output_folder(folder, "replay", force=force) as out:
            out.publish(self.write)
        return Path(folder) / REPORT

    def write(self, folder: Path) -> None:
        """Write summary.json, the aircraft, tables, report.html and the bag of all estimates into an empty folder.

        Raises InputError where it cannot be written.
        """
        write_run(folder, self.run)
        write_aircraft(folder, self.aircraft)
        write_estimates(
            folder / ESTIMATES_BAG,
            self.history,
            self.stamps_ns,
            aircraft=self.aircraft.name,
            method=self.settings.method,
            frame_id=self.frame_id,
            faults=self.faults.reports if self.faults else (),
        )


def replay(
    flight: FlightFile,
    settings: Mapping[str, object] | None = None,
    *,
    judge_faults: bool = True,
    progress: Progress | None = None,
    at_once: int = PIECE,
) -> Replay:
    """Identifies a flight's derivatives from its bag as the live node would have, and looks for faults.

    ``settings``: any parameter of the node, e.g. ``{"method": "iv_rft", "window": 20.0, "publish_rate": 5.0}``; the
    rest is as by default. ``progress`` is called with the share done (0..1) and what is being done. A bag is read in
    pieces of ``at_once`` messages, so that the memory that is needed does not grow with the flight; the results do not
    depend on it.

    Raises InputError where a setting is wrong, the bag cannot be read, lacks a joint of the aircraft, or gives no
    sample.
    """
    flights = flight_list(flight, "flight")
    if len(flights) != 1:
        raise InputError(f"flight: got {len(flights)} flights, expected one")
    (flight,) = flights
    chosen, publish_rate = replay_settings(settings or {})
    truth = truth_at_end(flight.path)
    tell: Progress = progress or (lambda share, doing: None)
    noted: list[str] = []
    reading = flight_pieces(flight.path, flight.aircraft, flight.topics, flight.body_frame, at_once)
    with noted_warnings(noted), reading as found:
        running = _Run(flight.aircraft, chosen, publish_rate, found, judge_faults, tell)
        for piece in found.pieces:
            running.take(piece)
        result = running.result(truth)
    return replace(result, warnings=tuple(noted))


class _Run:
    """A replay that is under way."""

    def __init__(
        self,
        aircraft: Aircraft,
        settings: OnlineSettings,
        publish_rate: float,
        flight: FlightPieces,
        judge_faults: bool,
        progress: Progress,
    ) -> None:
        self.aircraft, self.settings, self.publish_rate = aircraft, settings, publish_rate
        self.flight, self.progress = flight, progress
        self.alignment: PieceAlignment | None = None
        self.state, self.schedule = estimator.init(aircraft, settings), schedule.Schedule(publish_rate)
        self.monitor = RecordedMonitor(aircraft, FaultSettings()) if judge_faults else None
        self.history, self.stamps = EstimatesLog(), array("q")
        self.samples = RecordedSamples(aircraft, flight.imu_messages)
        self.flow = flow_angle_filter.init(as_estimated(aircraft))
        self.checks = FlightChecks(aircraft)
        self.spans: dict[str, tuple[float, float]] = {}  # s, by topic
        self.joints: tuple[str, ...] = ()
        self.commands_from, self.frame_id = math.inf, ""
        self.began = math.inf  # s
        self.density_measured = False  # whether any air data told it
        self.done = 0  # messages

    def take(self, piece: FlightPiece) -> None:
        """The next messages."""
        streams = piece.streams
        if self.alignment is None:
            carried = carried_by(streams, self.settings.actuators)
            self.alignment = PieceAlignment(self.aircraft, self.settings.max_gap, carried)
            interval = streams.actuators.interval
            self.state = estimator.init(self.aircraft, self.settings, command_interval=interval)
        self.density_measured |= bool(np.isfinite(streams.air_data.values[:, 3]).any())
        self.joints, self.frame_id = streams.actuators.names, streams.imu.frame_id or self.frame_id
        self.spans = joined_spans(self.spans, stamp_spans(streams))
        count = sum(len(stream.arrival) for stream in streams.by_topic.values())
        aligned, known = self.alignment.take(streams, last=piece.last), len(self.stamps)
        self.began = min(self.began, float(aligned.time[0])) if aligned.time.size else self.began
        attitude = self.checks.add(aligned, streams.imu)
        if piece.last:
            self.checks.check(self.flight.name)
        self._identify(aligned, count)
        self._keep(aligned, attitude)
        if self.monitor is not None:
            self.monitor.hear(streams, piece.commands, self._published(known), lambda s: self._tell(s, count, _FAULTS))
        self.done += count

    def _identify(self, aligned: AlignedSamples, count: int) -> None:
        """Update the estimator with every sample, and estimate where that falls due."""
        begin = aligned.commands_from
        columns = (part.tolist() for part in (aligned.time, aligned.samples, aligned.wait))
        for i, (moment, sample, wait) in enumerate(zip(*columns, strict=True)):
            if i == begin and not self.state.model.sample.commanded:
                self.state = estimator.begin_with_commands(self.state, moment)
                self.commands_from = moment
            estimator.update(self.state, moment, sample)
            if schedule.due(self.schedule, moment, wait):
                self.history.append(estimate(self.state, moment))
                self.stamps.append(int(aligned.stamps[i]))
            if i % REPORT_EVERY == 0:
                self._tell(i / aligned.time.size, count, _IDENTIFYING)

    def _keep(self, aligned: AlignedSamples, attitude: Array) -> None:
        """What the report shows of the samples, with their attitude (N, 3), rad."""
        complete = flow_angle_filter.complete_many(self.flow, aligned.time, aligned.samples, self.settings.max_gap)
        self.samples.add(aligned.time, complete, attitude)

    def _published(self, first: int) -> Iterator[RecordedEstimates]:
        """The estimates from a place on, for the fault monitor."""
        for stamp, one in zip(self.stamps[first:], self.history[first:], strict=True):
            yield RecordedEstimates(stamp, identifier_estimates(one.derivatives.values(), one.servos.values()))

    def _tell(self, share: float, count: int, part: tuple[float, float, str]) -> None:
        """Tell the progress: the ``share`` that is done of a part of the work on a piece of ``count`` messages."""
        begin, end, doing = part
        within = begin + (end - begin) * share if self.monitor is not None else share
        self.progress(min((self.done + within * count) / max(self.flight.messages, 1), 1.0), doing)

    def result(self, truth: Truth) -> Replay:
        """What was found. Raises InputError where no sample could be aligned."""
        rejected = self.alignment.rejected if self.alignment is not None else {}
        last = self.schedule.previous
        if last is None:
            Actuation.of(self.aircraft).require(self.joints, self.flight.name)
            raise InputError(why_nothing_aligned(self.flight.name, self.spans, rejected, self.settings.max_gap))
        estimator.complete(self.state)  # no further sample gives it time
        final = estimate(self.state, last)
        inputs = self.state.inputs
        broken = inputs.interruptions.fault(inputs.previous[0], self.settings.max_gap) if inputs.previous else ""
        opposite = opposite_estimates(self.aircraft, final.derivatives)
        if not self.density_measured:
            warn_without_density(self.aircraft, self.flight.name)
        for wrong in filter(None, (inputs.unchanging.fault, broken, *opposite)):
            warnings.warn(f"{self.flight.name}: {wrong}", InputWarning, stacklevel=2)
        seconds = last - self.began
        if seconds < FIRST_ESTIMATE and not any(math.isfinite(d.value) for d in final.derivatives.values()):
            raise InputError(too_short_to_replay(self.flight.name, seconds))
        self.progress(1.0, _FAULTS[2] if self.monitor is not None else _IDENTIFYING[2])
        return Replay(
            aircraft=self.aircraft,
            settings=self.settings,
            publish_rate=self.publish_rate,
            samples=self.samples,
            flow=self.flow,
            commands_from=self.commands_from,
            rejected=counts_by_reason(rejected),
            history=self.history,
            stamps_ns=np.array(self.stamps, np.int64),
            final=final,
            frame_id=self.frame_id,
            truth=truth,
            covariance=estimate_covariance(self.state),
            faults=self.monitor.verdict if self.monitor is not None else None,
        )


def replay_settings(values: Mapping[str, object]) -> tuple[OnlineSettings, float]:
    """The estimator's settings and the publish rate (Hz). Raises InputError naming the key or value that is wrong."""
    others = dict(values)
    rate = others.pop("publish_rate", PUBLISH_RATE)
    try:
        publish_rate = float(rate)  # type: ignore[arg-type]  # whatever was given, a text included
    except (TypeError, ValueError):
        publish_rate = float("nan")
    if not 0.01 <= publish_rate <= 1000.0:
        raise InputError(f"setting publish_rate = {rate!r}: expected 0.01 to 1000 Hz")
    return OnlineSettings.from_mapping(others), publish_rate
