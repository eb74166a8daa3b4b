"""``sysid demo``: plays a recorded flight on ROS topics, identifies it live, and shows the estimates.

Few aircraft measure where their surfaces are. Where the bag holds commands and positions, the flight is identified from
the commands, and at the end it is said what the positions would have added.
"""

from __future__ import annotations

import argparse
import math
import statistics
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console, RenderableType
from rich.live import Live

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.live.live_table import LiveStatus, ReferenceValues, live_table
from sysid_node.cli.live.processes import node_process
from sysid_node.cli.live.ros_domain import own_domain
from sysid_node.cli.live.viewing import viewer_beside
from sysid_node.cli.shared import options
from sysid_node.errors import InputError
from sysid_node.flight.align import stamp_spans, why_nothing_aligned
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.commands import COMMANDS, holds_commands
from sysid_node.flight.logs.opening import carried_by
from sysid_node.flight.streams import Streams
from sysid_node.flight.topics import ACTUATORS, INPUT_TOPICS, topic_names
from sysid_node.flight.truth import read_truth
from sysid_node.online import replay
from sysid_node.online.alignment.in_pieces import AlignedSamples, align_streams
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.report.files.runs.run_folder import write_aircraft, write_run
from sysid_node.report.results.from_replay import replay_result
from sysid_node.report.results.recorded_samples import RecordedSamples
from sysid_node.report.results.run_result import RunResult

if TYPE_CHECKING:
    from sysid_node.ros.support.follower import Follower

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

PUBLISH_RATE = 10.0  # Hz
STALE = "stale input"  # status of estimates while nothing comes
DIAGNOSTICS_PERIOD = 1.2  # s in which /diagnostics sends its last totals
PATIENCE = 12.0  # s after which messages that the identifier still has not received count as lost
#: A bag may be played faster than it was flown; no message may be lost on a busy computer.
RELIABLE = ("reliability:=reliable", "depth:=5000")


@dataclass(frozen=True)
class DemoFlight:
    """The flight that is played, its aircraft, and the true derivatives.

    ``topics``: the names under which the identifier hears its inputs.
    """

    bag: Path
    aircraft: Aircraft
    topics: Mapping[str, str]
    streams: Streams
    aligned: AlignedSamples
    truth: dict[str, float]  # empty where it is not known

    @property
    def start_ns(self) -> int:
        """The header stamp of time zero."""
        return int(self.aligned.stamps[0]) - round(1e9 * float(self.aligned.time[0]))

    @property
    def from_commands(self) -> bool:
        """Whether commands are heard in place of the surfaces' positions."""
        return self.topics[ACTUATORS] == COMMANDS

    @property
    def reference(self) -> ReferenceValues:
        """The truth where it is known, else the aircraft file."""
        if self.truth:
            return ReferenceValues("true", self.truth)
        return ReferenceValues("file", {name: d.value for name, d in self.aircraft.derivatives.items()})


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("demo", help="identify a recorded flight live, over DDS", description=__doc__)
    parser.add_argument("bag", metavar="BAG", type=Path, help="a bag; BAG.truth.json beside it holds the true values")
    parser.add_argument("--aircraft", default="cdrw", help="file or name (default: cdrw)")
    parser.add_argument("--rate", type=float, default=1.0, help="how many times as fast as flown (default: 1)")
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path("out/demo"), help="default: out/demo")
    parser.add_argument("--positions", action="store_true", help="take measured positions of the surfaces")
    options.add_view(parser)
    options.add_force(parser)
    return parser


def _write(folder: Path, result: RunResult, aircraft: Aircraft) -> None:
    write_run(folder, result)
    write_aircraft(folder, aircraft)


def run(args: argparse.Namespace) -> None:
    """Plays and identifies the flight, then writes the report and prints a summary."""
    if not args.rate > 0.0:
        raise InputError(f"--rate {args.rate:g}: expected a number over zero")
    aircraft = load_aircraft(args.aircraft)
    commanded = not args.positions and holds_commands(args.bag)
    flight = _read(args.bag, aircraft, topic_names([f"{ACTUATORS}:={COMMANDS}"] if commanded else []))
    own_domain()
    inputs, logs = options.inputs_of([args.bag], args.aircraft), ("identifier.log", "player.log", "view.log")
    with output_folder(args.out, "demo", inputs=inputs, force=args.force, working=logs) as out:
        with viewer_beside(args.aircraft, args.view, args.out):
            follower, history = _fly(flight, args.aircraft, args.rate, args.out)
        out.publish(lambda folder: _write(folder, _result(flight, follower, history), aircraft))
    print(_summary(flight, history[-1]))
    if flight.from_commands:
        print(_with_positions(flight, history[-1]))
    print(f"report: {args.out / 'report.html'}")
    lost = _lost(flight, follower)
    if lost:
        print(f"{lost} messages were lost on the way; a lower --rate loses fewer")


def _result(flight: DemoFlight, follower: Follower, history: list[Estimates]) -> RunResult:
    """What the report shows."""
    return replay_result(
        flight.aircraft,
        OnlineSettings(),
        recorded=RecordedSamples.of(flight.aircraft, flight.aligned.time, flight.aligned.samples),
        history=history,
        rejected=_rejected(follower),
        truth=flight.truth,
        title=f"{flight.bag.name}, identified live",
        commanded=flight.aligned.commands_from < flight.aligned.time.size,
    )


def _read(bag: Path, aircraft: Aircraft, topics: Mapping[str, str]) -> DemoFlight:
    streams, settings = read_streams(bag, topics), OnlineSettings()
    aligned = align_streams(aircraft, streams, settings.max_gap, carried_by(streams, settings.actuators))
    if not aligned.time.size:
        raise InputError(why_nothing_aligned(streams.name, stamp_spans(streams), aligned.rejected))
    return DemoFlight(bag, aircraft, topics, streams, aligned, read_truth(bag))


def _fly(flight: DemoFlight, aircraft: str, rate: float, out: Path) -> tuple[Follower, list[Estimates]]:
    """The follower of the flight and the estimates over time; player and identifier run as processes.

    The live table is shown until the flight is over.
    """
    import rclpy  # noqa: PLC0415  # reads its domain from the environment
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415

    from sysid_node.ros.support.follower import Follower  # noqa: PLC0415

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    follower = Follower(flight.start_ns)
    try:
        identifier = ["--ros-args", "-p", f"aircraft:={aircraft}", "-p", f"publish_rate:={PUBLISH_RATE}"]
        for ours, theirs in flight.topics.items():
            identifier += ["-r", f"{ours}:={theirs}"]
            identifier += [word for how in RELIABLE for word in ("-p", f"qos_overrides.{theirs}.subscription.{how}")]
        player = [str(flight.bag), "--rate", str(rate), "--wait", "60", "--wait-for", *flight.topics.values()]
        with node_process("identifier", identifier, out) as identifying, node_process("player", player, out) as playing:
            _watch(flight, follower, identifying, playing)
            history = _in_flight(follower.history)
    finally:
        follower.close()
        rclpy.try_shutdown()
    if not history:
        raise RuntimeError(f"no estimate came; {out / 'identifier.log'} may say why")
    return follower, history


def _in_flight(history: Sequence[Estimates]) -> list[Estimates]:
    """The estimates without the last ones that the identifier calls stale: after the flight nothing comes any more."""
    end = len(history)
    while end > 1 and all(found.status == STALE for found in history[end - 1].derivatives.values()):
        end -= 1
    return list(history[:end])


def _watch(
    flight: DemoFlight, follower: Follower, identifying: subprocess.Popen[bytes], playing: subprocess.Popen[bytes]
) -> None:
    """Show the live table until the flight is over or a node ends."""
    console = Console()
    with Live(console=console, auto_refresh=False) as live:
        while playing.poll() is None and identifying.poll() is None:
            follower.listen(0.1)
            live.update(_picture(flight, follower, console.width, console.height), refresh=True)
        _hear_out(flight, follower, identifying)
        live.update(_picture(flight, follower, console.width), refresh=True)
    console.print()


def _hear_out(flight: DemoFlight, follower: Follower, identifying: subprocess.Popen[bytes]) -> None:
    """Listen until the identifier has received all that was played, or receives nothing more.

    On a busy computer it is still behind when the player has finished.
    """
    left, waited = math.inf, 0.0
    while left > 0 and waited < PATIENCE and identifying.poll() is None:
        follower.listen(DIAGNOSTICS_PERIOD)
        before, left = left, _lost(flight, follower)
        waited = 0.0 if left < before else waited + DIAGNOSTICS_PERIOD


def _picture(flight: DemoFlight, follower: Follower, width: int, height: int | None = None) -> RenderableType:
    rates = [(topic, follower.word("input", f"{topic}: rate (Hz)")) for topic in INPUT_TOPICS]
    history = follower.history if height else _in_flight(follower.history)  # without a height: at the end
    moment = LiveStatus(
        title=f"{flight.aircraft.name}, {flight.bag.name}",
        seconds=history[-1].time if history else 0.0,
        duration=float(flight.aligned.time[-1]),
        # At the end the rates, of the last second, are those of silence.
        remark=" · ".join(f"{topic} {float(rate):.0f} Hz" for topic, rate in rates if float(rate or 0) > 0.0),
        estimates=history[-1] if history else None,
    )
    return live_table(moment, tuple(flight.aircraft.derivatives), flight.reference, width, height)


def _rejected(follower: Follower) -> dict[str, int]:
    """Messages that the identifier rejected, as it last reported on /diagnostics."""
    values = follower.words["input"].values if "input" in follower.words else ()
    prefix = "rejected, "
    return {pair.key.removeprefix(prefix): int(pair.value) for pair in values if pair.key.startswith(prefix)}


def _lost(flight: DemoFlight, follower: Follower) -> int:
    """The number of messages that the player sent and the identifier did not receive."""
    sent = sum(len(stream.arrival) for stream in flight.streams.by_topic.values())
    return sent - sum(int(follower.word("input", f"{topic}: received") or 0) for topic in INPUT_TOPICS)


def _summary(flight: DemoFlight, final: Estimates) -> str:
    """Two lines: valid derivatives, and intervals that contain the reference."""
    valid = [d for d in final.derivatives.values() if d.valid]
    expected = flight.reference.values
    inside = sum(d.lower <= expected[d.name] <= d.upper for d in valid)
    what = "true value" if flight.truth else "aircraft file's value"
    heard = "from commands" if flight.from_commands else "from actuators taken as positions"
    return (
        f"{len(valid)} of {len(final.derivatives)} derivatives valid after {final.time:.0f} s of flight, {heard}\n"
        f"{inside} of these {len(valid)} intervals contain the {what}"
    )


def _with_positions(flight: DemoFlight, final: Estimates) -> str:
    """One line: what measured positions of the surfaces would have given, by a replay of the same flight."""
    measured, settings = _read(flight.bag, flight.aircraft, topic_names()).aligned, OnlineSettings()
    (best,) = replay.run(flight.aircraft, settings, measured.time, measured.samples, measured.time[-1:])
    both = [name for name, d in best.derivatives.items() if d.valid and final.derivatives[name].valid]
    ratio = [best.derivatives[name].standard_error / final.derivatives[name].standard_error for name in both]
    width = f", with intervals {statistics.median(ratio):.2f} times as wide (median)" if ratio else ""
    return f"with measured positions {sum(d.valid for d in best.derivatives.values())} would be valid{width}"
