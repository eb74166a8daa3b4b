"""``sysid replay``: identifies an aircraft from a bag with the live node's functions, message for message.

``replay`` is the work, ``write_replay`` the files; the command is a thin shell around both.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.shared.terminal import progress_bar, show_estimates, show_faults
from sysid_node.errors import InputError
from sysid_node.faults.model.reference_model import known_of
from sysid_node.faults.recorded_flight import Heard, Verdict, judge
from sysid_node.faults.settings import Settings as FaultSettings
from sysid_node.flight.actuation import Actuation
from sysid_node.flight.align import flat, why_nothing_aligned
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.commands import read_commands
from sysid_node.flight.frames import BODY_FRAMES, BodyFrame
from sysid_node.flight.streams import Stamps, Streams
from sysid_node.flight.topics import topic_names
from sysid_node.flight.truth import Truth, truth_at_end
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.alignment.schedule import due_times
from sysid_node.online.alignment.whole_record import Aligned, align_streams
from sysid_node.online.settings import Settings
from sysid_node.online.types import Estimates
from sysid_node.online.whole_record import run as run_online
from sysid_node.report.files.estimates_bag import write_estimates
from sysid_node.report.files.run_folder import write_run
from sysid_node.report.results.from_replay import replay_result

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

PUBLISH_RATE = 20.0  # Hz, the node's default
ESTIMATES_BAG = "estimates"
TABLE_ROWS = 600  # times at which the tables and the report show estimates; the bag holds all


@dataclass(frozen=True)
class Replay:
    """What a bag gave: aligned samples, and the estimates as the live node would have published them."""

    aircraft: Aircraft
    settings: Settings
    publish_rate: float  # Hz
    aligned: Aligned
    history: Sequence[Estimates]
    stamps_ns: Stamps  # (K,) header stamps at which each of ``history`` (K,) fell due
    final: Estimates  # after the last sample, whether or not one was due
    streams: Streams


def replay(
    bag: str | Path,
    aircraft: Aircraft,
    settings: Settings,
    *,
    publish_rate: float = PUBLISH_RATE,
    topics: Mapping[str, str] | None = None,
    frame: BodyFrame = "flu",
    progress: Callable[[float], None] | None = None,
) -> Replay:
    """Decodes, aligns and identifies; ``progress`` hears the share of the flight that is done.

    Raises InputError where the bag cannot be read, lacks a joint of the aircraft, or gives no sample.
    """
    streams = read_streams(bag, topics, frame)
    Actuation.of(aircraft).require(streams.actuators.names, streams.name)
    aligned = align_streams(aircraft, streams, settings.max_gap)
    if not aligned.time.size:
        raise InputError(why_nothing_aligned(streams, aligned.rejected))
    time = aligned.time
    due = due_times(time, aligned.wait, publish_rate)
    last = float(time[-1])
    share = (lambda t: progress(t / last if last else 1.0)) if progress else None
    history = run_online(aircraft, settings, time, aligned.samples, np.union1d(due, time[-1:]), share)
    published = history if due.size and due[-1] == last else history[:-1]
    stamps = aligned.stamps[np.searchsorted(time, due)]
    return Replay(aircraft, settings, publish_rate, aligned, published, stamps, history[-1], streams)


def judge_replay(done: Replay, bag: str | Path, progress: Callable[[float], None] | None = None) -> Verdict:
    """What the fault monitor, hearing the same messages and these estimates, would have said in flight."""
    pairs = zip(done.stamps_ns.tolist(), done.history, strict=True)
    heard = (Heard(stamp, known_of(estimates)) for stamp, estimates in pairs)
    return judge(done.aircraft, FaultSettings(), done.streams, read_commands(bag), heard, progress)


def write_replay(folder: Path, done: Replay, truth: Truth | None = None, faults: Verdict | None = None) -> None:
    """Writes summary.json, the tables and report.html, and the bag of all estimates in ``folder``/estimates.

    What an earlier replay left there is replaced. Raises InputError where the folder cannot be written.
    """
    every = max(len(done.history) // TABLE_ROWS, 1)
    # While the estimator settles nothing is included yet, and estimates have the same time.
    shown = {estimates.time: estimates for estimates in (*done.history[every - 1 :: every], done.final)}
    flow = flow_angle_filter.init(done.aircraft)
    aligned, gap = done.aligned, done.settings.max_gap
    samples = flow_angle_filter.complete_many(flow, aligned.time, aligned.samples, gap)
    result = replay_result(
        done.aircraft,
        done.settings,
        time=aligned.time,
        samples=samples,
        history=list(shown.values()),
        rejected=flat(aligned.rejected),
        truth=truth.values if truth else None,
        truth_since=truth.since if truth else None,
        faults=faults,
        remarks=flow_angle_filter.remarks(flow),
    )
    settings = {**result.settings, "publish_rate": done.publish_rate}
    write_run(folder, replace(result, settings=settings))
    bag = folder / ESTIMATES_BAG
    _remove_old_bag(bag)
    write_estimates(
        bag,
        done.history,
        done.stamps_ns,
        aircraft=done.aircraft.name,
        method=done.settings.method,
        frame_id=done.streams.imu.frame_id,
        faults=faults.said if faults else (),
    )


def _remove_old_bag(bag: Path) -> None:
    """Removes the bag of an earlier replay, and nothing else."""
    if not bag.exists():
        return
    strangers = {file.name for file in bag.iterdir()} - {"metadata.yaml", f"{ESTIMATES_BAG}.mcap"}
    if strangers:
        raise InputError(f"{bag}: holds {min(strangers)}, which no replay wrote; give another folder as --out")
    shutil.rmtree(bag)


def parse_settings(texts: Iterable[str], frequencies: str | None = None) -> tuple[Settings, float]:
    """The estimator's settings and the publish rate (Hz) from ``key=value`` texts.

    Raises InputError naming the key or the value that is wrong.
    """
    values: dict[str, str] = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator:
            raise InputError(f"--set {text!r}: expected KEY=VALUE, e.g. window=20")
        values[key.strip()] = value.strip()
    if frequencies is not None:
        values["frequencies"] = frequencies
    rate = values.pop("publish_rate", str(PUBLISH_RATE))
    try:
        publish_rate = float(rate)
    except ValueError:
        publish_rate = float("nan")
    if not 0.01 <= publish_rate <= 1000.0:
        raise InputError(f"setting publish_rate = {rate!r}: expected 0.01 to 1000 Hz")
    return Settings.from_mapping(values), publish_rate


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("replay", help="identify an aircraft from a bag, as the live node does")
    parser.description = "Identify an aircraft from a bag; writes summary.json, tables, report.html and estimates/."
    parser.add_argument("bag", metavar="BAG", type=Path, help="rosbag2 folder, .mcap or .db3 file")
    parser.add_argument("--aircraft", required=True, metavar="FILE|NAME", help="aircraft file, or name as in cdrw")
    parser.add_argument("--out", required=True, metavar="DIR", type=Path, help="folder for the results")
    parser.add_argument("--frequencies", metavar="START:STEP:STOP", help="lines of the transform, Hz")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="any node parameter")
    parser.add_argument(
        "--topic", action="append", default=[], metavar="OURS:=THEIRS", help="a topic's name in the bag"
    )
    parser.add_argument("--body-frame", choices=BODY_FRAMES, default="flu", help="of the IMU messages (default: flu)")
    parser.add_argument("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Replays a bag."""
    aircraft = load_aircraft(args.aircraft)
    settings, publish_rate = parse_settings(args.set, args.frequencies)
    topics, truth = topic_names(args.topic), truth_at_end(args.bag)
    with progress_bar(f"replay {args.bag.name}", quiet=args.quiet) as progress:
        done = replay(
            args.bag,
            aircraft,
            settings,
            publish_rate=publish_rate,
            topics=topics,
            frame=args.body_frame,
            progress=progress,
        )
    with progress_bar("look for faults", quiet=args.quiet) as progress:
        faults = judge_replay(done, args.bag, progress)
    write_replay(args.out, done, truth, faults)
    if not args.quiet:
        show_estimates(done.final, truth.values, truth.since)
        show_faults(faults)
        print(args.out / "report.html")
