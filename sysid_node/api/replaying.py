"""A flight identified as the live node does: the same functions, message for message."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.api.estimated_run import EstimatedRun
from sysid_node.api.flight_file import FlightFile
from sysid_node.errors import InputError
from sysid_node.faults.model.reference_model import identifier_estimates
from sysid_node.faults.recorded_flight import FaultVerdict, RecordedEstimates, judge
from sysid_node.faults.settings import FaultMonitorSettings as FaultSettings
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import counts_by_reason, why_nothing_aligned
from sysid_node.flight.commanded import carried_in_words
from sysid_node.flight.logs.opening import carried_by, open_streams, recorded_commands
from sysid_node.flight.record import FlightRecord
from sysid_node.flight.streams import Stamps, Streams
from sysid_node.flight.truth import Truth, truth_at_end
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.alignment.schedule import due_times
from sysid_node.online.alignment.whole_record import AlignedSamples, align_streams
from sysid_node.online.estimates.covariance import EstimateCovariance, estimate_covariance
from sysid_node.online.replay import run_to_end
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates
from sysid_node.report.files.estimates_bag import write_estimates
from sysid_node.report.files.output_folder import output_folder
from sysid_node.report.files.run_folder import REPORT, write_run
from sysid_node.report.results.from_replay import replay_result
from sysid_node.report.results.run_result import RunResult

PUBLISH_RATE = 20.0  # Hz, the node's default
ESTIMATES_BAG = "estimates"
TABLE_ROWS = 600  # times at which the tables and the report show estimates; the bag holds all

#: Share of a replay's time at which the search for faults begins, for the progress bar.
_FAULTS_FROM = 0.7

Progress = Callable[[float, str], None]


@dataclass(frozen=True, repr=False)
class Replay(EstimatedRun):
    """What a bag gave: aligned samples, and the estimates as the live node would have published them."""

    aircraft: Aircraft
    settings: OnlineSettings
    publish_rate: float  # Hz
    aligned: AlignedSamples
    history: Sequence[Estimates]
    stamps_ns: Stamps  # (K,) header stamps at which each of ``history`` (K,) fell due
    final: Estimates  # after the last sample, whether or not one was due
    streams: Streams
    truth: Truth  # empty where it is not known
    covariance: EstimateCovariance | None  # of ``final``; None where nothing was estimated
    faults: FaultVerdict | None = None  # None: nothing was judged

    @cached_property
    def run(self) -> RunResult:  # type: ignore[override]  # computed when it is first needed
        """Everything that the report shows, estimates over time thinned to what a table holds."""
        every = max(len(self.history) // TABLE_ROWS, 1)
        # While the estimator settles nothing is included yet, and estimates have the same time.
        shown = {estimates.time: estimates for estimates in (*self.history[every - 1 :: every], self.final)}
        flow = flow_angle_filter.init(self.aircraft)
        time, gap = self.aligned.time, self.settings.max_gap
        commanded = self.aligned.commands_from < time.size
        carried = carried_in_words(self.aircraft, self.settings.actuators, commanded)
        result = replay_result(
            self.aircraft,
            self.settings,
            time=time,
            samples=flow_angle_filter.complete_many(flow, time, self.aligned.samples, gap),
            history=list(shown.values()),
            rejected=counts_by_reason(self.aligned.rejected),
            truth=self.truth.values,
            truth_since=self.truth.since,
            faults=self.faults,
            remarks=[*flow_angle_filter.remarks(flow), *([carried] if carried else [])],
        )
        publishing = {"publish_rate": self.publish_rate, "actuators_carry": "commands" if commanded else "positions"}
        signals = replace(result.signals, flight=self._with_attitude(result.signals.flight))
        return replace(result, settings={**result.settings, **publishing}, signals=signals)

    def _with_attitude(self, flight: FlightRecord | None) -> FlightRecord | None:
        """The flight with roll, pitch and heading, of which the estimator takes none, where they were recorded."""
        stamps, angles = self.streams.imu.arrival.stamp_ns, self.streams.imu.attitude
        if flight is None or not np.isfinite(angles).any():
            return flight
        order = np.argsort(stamps, kind="stable")
        rows = order[np.searchsorted(stamps[order], self.aligned.stamps)]
        columns = dict(zip(("phi", "theta", "psi"), angles[rows].T, strict=True))
        return replace(flight, columns={**flight.columns, **columns})

    def save(self, folder: str | Path, *, force: bool = False) -> Path:
        """Write what ``sysid replay`` writes; returns the path of the report.

        What an earlier replay left in the folder is replaced. Raises InputError where the folder holds anything else
        and ``force`` is not given, or cannot be written.
        """
        with output_folder(folder, "replay", force=force) as out:
            out.publish(self.write)
        return Path(folder) / REPORT

    def write(self, folder: Path) -> None:
        """Write summary.json, the tables, report.html and the bag of all estimates into an empty folder.

        Raises InputError where it cannot be written.
        """
        write_run(folder, self.run)
        write_estimates(
            folder / ESTIMATES_BAG,
            self.history,
            self.stamps_ns,
            aircraft=self.aircraft.name,
            method=self.settings.method,
            frame_id=self.streams.imu.frame_id,
            faults=self.faults.reports if self.faults else (),
        )


def replay(
    flight: FlightFile,
    settings: Mapping[str, object] | None = None,
    *,
    judge_faults: bool = True,
    progress: Progress | None = None,
) -> Replay:
    """Identifies a flight's derivatives from its bag as the live node would have, and looks for faults.

    ``settings``: any parameter of the node, e.g. ``{"method": "iv_rft", "window": 20.0, "publish_rate": 5.0}``; the
    rest is as by default. ``progress`` is called with the share done (0..1) and what is being done.

    Raises InputError where a setting is wrong, the bag cannot be read, lacks a joint of the aircraft, or gives no
    sample.
    """
    chosen, publish_rate = replay_settings(settings or {})
    tell: Progress = progress or (lambda share, doing: None)
    truth = truth_at_end(flight.path)
    found = _estimated(flight, chosen, publish_rate, truth, lambda s: tell(_FAULTS_FROM * s, "identifying"))
    if not judge_faults:
        return found
    later = _judged(found, flight.path, lambda s: tell(_FAULTS_FROM + (1 - _FAULTS_FROM) * s, "looking for faults"))
    return replace(found, faults=later)


def _estimated(
    flight: FlightFile, settings: OnlineSettings, publish_rate: float, truth: Truth, progress: Callable[[float], None]
) -> Replay:
    """Decodes, aligns and identifies."""
    streams = open_streams(flight.path, flight.aircraft, flight.topics, flight.body_frame)
    Actuation.of(flight.aircraft).require(streams.actuators.names, streams.name)
    carried = carried_by(streams, settings.actuators)
    aligned = align_streams(flight.aircraft, streams, settings.max_gap, carried)
    if not aligned.time.size:
        raise InputError(why_nothing_aligned(streams, aligned.rejected))
    time = aligned.time
    due = due_times(time, aligned.wait, publish_rate)
    last = float(time[-1])
    history, state = run_to_end(
        flight.aircraft,
        settings,
        time,
        aligned.samples,
        np.union1d(due, time[-1:]),
        lambda t: progress(t / last if last else 1.0),
        aligned.commands_from,
    )
    published = history if due.size and due[-1] == last else history[:-1]
    stamps = aligned.stamps[np.searchsorted(time, due)]
    covariance = estimate_covariance(state)
    return Replay(
        flight.aircraft, settings, publish_rate, aligned, published, stamps, history[-1], streams, truth, covariance
    )


def _judged(found: Replay, bag: Path, progress: Callable[[float], None]) -> FaultVerdict:
    """What the fault monitor, hearing the same messages and these estimates, would have said in flight."""
    pairs = zip(found.stamps_ns.tolist(), found.history, strict=True)
    published = (
        RecordedEstimates(stamp, identifier_estimates(estimates.derivatives.values(), estimates.servos.values()))
        for stamp, estimates in pairs
    )
    return judge(found.aircraft, FaultSettings(), found.streams, recorded_commands(bag), published, progress)


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
