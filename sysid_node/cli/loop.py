"""``sysid loop``: an aircraft in closed loop over DDS; a control fails, the model is identified again, the gains adapt.

Simulator, identifier, exciter and controller run in processes of their own, this one watches. At 30 s something fails.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.live.processes import node_process
from sysid_node.cli.live.ros_domain import make_folder, own_domain
from sysid_node.errors import InputError
from sysid_node.online.settings import METHODS
from sysid_node.report.pages.closed_loop_page import write_loop
from sysid_node.report.results.closed_loop import ClosedLoopFlight, Event

if TYPE_CHECKING:
    from sysid_node.ros.support.loop_watch import LoopWatch

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

ACTUATORS = "actuator_lag:time_constant=0.05"
ONSET, EXCITE_AT = 30.0, 3.0  # s: failure and first excitation
SETTLED = 10.0  # s after the failure from which tracking errors are counted apart
PAUSE = 3.0  # s from an abort of the excitation until it is requested again
START_UP = 60.0  # s in which the first command must come
WATCHED = ("Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr")
NODES: Mapping[str, tuple[str, ...]] = {
    "flight_simulator": (f"effects:='{ACTUATORS}'",),
    "identifier": (),
    "exciter": ("watch:=true", "accuracy:=0.15"),
    "fault_monitor": (),
    "adaptive_controller": (),
}


@dataclass(frozen=True)
class LoopScenario:
    """The flight to simulate, and how it is controlled and identified."""

    aircraft: Aircraft
    name: str  # name or file of the aircraft, as the nodes receive it
    fail: str  # the effect that begins at ONSET; "" = none
    seconds: float
    adapt: bool
    turbulence: str
    method: str
    out: Path


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("loop", help="an adaptive controller in closed loop, over DDS", description=__doc__)
    add = parser.add_argument
    add("--aircraft", default="cdrw", help="file or name (default: cdrw)")
    add("--fail", default="control_effectiveness_loss:elevator=0.6", help="effect that sets in at 30 s; '' for none")
    add("--seconds", type=float, default=60.0, help="of flight (default: 60)")
    add("--fixed", dest="adapt", action="store_false", help="with the fixed gains of the aircraft file, to compare")
    add("--turbulence", default="none", help="none, light, moderate or severe (default: none)")
    add("--method", choices=METHODS, default="sls_rft", help="of the identifier (default: sls_rft)")
    add("--out", metavar="DIR", type=Path, default=Path("out/loop"), help="default: out/loop")
    return parser


def run(args: argparse.Namespace) -> None:
    """Flies, shows the flight, writes the report and prints a summary."""
    if not 5.0 <= args.seconds <= 36000.0:
        raise InputError(f"--seconds {args.seconds:g}: expected 5 to 36000")
    aircraft = load_aircraft(args.aircraft)
    make_folder(args.out)
    own_domain()
    plan = LoopScenario(
        aircraft, args.aircraft, args.fail, args.seconds, args.adapt, args.turbulence, args.method, args.out
    )
    episode = _fly(plan)
    write_loop(args.out, episode)
    print(_summary(plan, episode))


def _fly(plan: LoopScenario) -> ClosedLoopFlight:
    import rclpy  # noqa: PLC0415  # reads its domain from the environment

    from sysid_node.ros.support.loop_watch import LoopWatch  # noqa: PLC0415

    _check_effects(plan)
    rclpy.init()
    watch = LoopWatch()
    try:
        with ExitStack() as stack:
            processes = [stack.enter_context(node_process(name, _arguments(plan, name), plan.out)) for name in NODES]
            events = _watch(plan, watch, processes)
    finally:
        watch.close()
        rclpy.try_shutdown()
    times = [time for time, _ in watch.tracking]
    errors = {axis: [row[f"{axis} error"] for _, row in watch.tracking] for axis in ("pitch", "roll", "sideslip")}
    commanded = {axis: [row[axis] for _, row in watch.tracking] for axis in ("pitch", "roll")}
    estimates = dict(watch.estimates.derivatives) if watch.estimates else {}
    return ClosedLoopFlight(
        plan.aircraft.name, plan.fail, ONSET, plan.adapt, times, errors, commanded, estimates, events, watch.troubles()
    )


def _check_effects(plan: LoopScenario) -> None:
    """Raise InputError on effects that the simulator would refuse half a minute later."""
    from sysid_node.sim import Simulator  # noqa: PLC0415  # JAX takes its time
    from sysid_node.sim.flying import live  # noqa: PLC0415  # JAX takes its time

    live.vector(Simulator(plan.aircraft), _effects(plan, failed=True).split())


def _effects(plan: LoopScenario, failed: bool) -> str:
    return f"{ACTUATORS} {plan.fail}" if failed and plan.fail else ACTUATORS


def _arguments(plan: LoopScenario, name: str) -> list[str]:
    """The command-line arguments of a node."""
    own = [f"aircraft:={plan.name}", *NODES[name]]
    if name == "flight_simulator":
        own.append(f"turbulence:={plan.turbulence}")
    if name == "identifier":
        own.append(f"method:={plan.method}")
    if name == "adaptive_controller":
        own.append(f"adapt:={str(plan.adapt).lower()}")
    return ["--ros-args", *(word for pair in own for word in ("-p", pair))]


def _watch(plan: LoopScenario, watch: LoopWatch, processes: Sequence[subprocess.Popen[bytes]]) -> list[Event]:
    """The events of the flight: sends set-points, starts excitation and the failure, and shows the live table."""
    console = Console()
    events: list[Event] = []
    news: dict[str, str] = {}
    waited, excite_at = 0.0, EXCITE_AT
    with Live(console=console, auto_refresh=False) as live:
        while watch.time < plan.seconds and all(process.poll() is None for process in processes):
            watch.listen(0.1)
            if not watch.tracking:
                waited += 0.1
                if waited > START_UP:
                    raise RuntimeError(f"no command came within {START_UP:g} s; the logs in {plan.out} may say why")
            watch.ask_for(set_points(watch.time))
            done = [event.text for event in events]
            if watch.time >= excite_at:
                watch.excite()
                events.append(Event(watch.time, "loop", "excitation asked for"))
                excite_at = math.inf
            if excite_at == math.inf and watch.value("exciter", "last event").startswith("aborted"):
                excite_at = watch.time + PAUSE
            if plan.fail and watch.time >= ONSET and plan.fail not in done:
                refused = watch.set_effects(_effects(plan, failed=True))
                if refused:
                    raise InputError(f"--fail {plan.fail}: {refused}")
                events.append(Event(watch.time, "loop", plan.fail))
            events += [
                Event(watch.time, node, text) for node, text in watch.news().items() if text and text != news.get(node)
            ]
            news |= watch.news()
            live.update(_picture(plan, watch), refresh=True)
    console.print()
    return events


def set_points(time: float) -> dict[str, float]:
    """Steps of roll and pitch, rad."""
    roll = (0.3, 0.0, -0.3, 0.0)[int(time / 4.0) % 4]
    pitch = (0.16, 0.08, 0.03, 0.08)[int((time + 1.0) / 3.0) % 4]
    return {"roll": roll, "pitch": pitch}


def _picture(plan: LoopScenario, watch: LoopWatch) -> RenderableType:
    """The live table with the flight's state and tracking errors."""
    table = Table(box=None, padding=(0, 1), header_style="bold")
    for heading in ("derivative", "file", "estimate", "95 % interval", "status"):
        table.add_column(heading, justify="left" if heading in ("derivative", "status") else "right")
    known = watch.estimates.derivatives if watch.estimates else {}
    for name in (n for n in WATCHED if n in plan.aircraft.derivatives):
        file = f"{plan.aircraft.derivatives[name].value:+.4f}"
        d = known.get(name)
        if d is None or not math.isfinite(d.value):
            table.add_row(name, file, "", "", d.status if d else "")
            continue
        style = "green" if d.valid else "dim"
        row = (name, file, f"{d.value:+.4f}", f"{d.lower:+.4f} to {d.upper:+.4f}", Text(d.status, style=style))
        table.add_row(*row)
    failed = bool(plan.fail) and watch.time >= ONSET
    head = Text(f"{plan.aircraft.name}  {watch.time:5.1f} of {plan.seconds:.0f} s  ", style="bold")
    head.append(plan.fail if failed else "nothing wrong", style="red" if failed else "green")
    lines = [f"{node}: {watch.said(node)}" for node in NODES]
    last = watch.tracking[-200:]
    errors = ", ".join(f"{axis} {_rms(last, axis):.2f} deg" for axis in ("pitch", "roll", "sideslip"))
    return Group(head, Text(f"tracking error over the last second: {errors}"), table, *(Text(x) for x in lines))


def _rms(rows: Sequence[tuple[float, Mapping[str, float]]], axis: str) -> float:
    values = [e for _, row in rows if math.isfinite(e := row.get(f"{axis} error", math.nan))]
    return math.degrees(math.sqrt(sum(v * v for v in values) / len(values))) if values else math.nan


def _summary(plan: LoopScenario, episode: ClosedLoopFlight) -> str:
    """Tracking errors before and after the failure, and the faults found; writes summary.json, too."""
    (plan.out / "summary.json").write_text(json.dumps(episode.summary(), indent=2) + "\n", encoding="utf-8")
    lines = [f"{'adaptive' if plan.adapt else 'fixed'} gains; tracking error (pitch, roll), rms:"]
    for name, start, stop in episode.spans(SETTLED):
        errors = (math.degrees(episode.rms(axis, start, stop)) for axis in ("pitch", "roll"))
        lines.append(f"  {name}: " + ", ".join(f"{error:.2f} deg" for error in errors))
    lines += [f"  fault said at {alarm.time:.1f} s: {alarm.text}" for alarm in episode.alarms]
    return "\n".join([*lines, f"report: {plan.out / 'report.html'}"])
