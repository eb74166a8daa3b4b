"""``sysid loop``: an aircraft in closed loop over DDS; a control fails, the model is identified again, the gains adapt.

Simulator, identifier, exciter, fault monitor and controller run in processes of their own; this one directs the flight.
"""

from __future__ import annotations

import argparse
import math
import warnings
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.live.loop_director import LoopDirector
from sysid_node.cli.live.loop_scenario import NODES, ONSET, LoopScenario
from sysid_node.cli.live.loop_table import loop_table
from sysid_node.cli.live.processes import node_process
from sysid_node.cli.live.ros_domain import own_domain
from sysid_node.cli.shared import options
from sysid_node.errors import InputError, InputWarning
from sysid_node.online.settings import METHODS
from sysid_node.report.files.loop_folder import write_loop_folder
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.report.results.closed_loop import ClosedLoopFlight, Event

if TYPE_CHECKING:
    from sysid_node.ros.support.loop_watch import LoopWatch

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

SETTLED = 10.0  # s after the failure from which tracking errors are counted apart


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
    meaning = "commands reach the identifier, or measured positions of the surfaces (default: commanded)"
    add("--surfaces", choices=("commanded", "measured"), default="commanded", help=meaning)
    add("--out", metavar="DIR", type=Path, default=Path("out/loop"), help="default: out/loop")
    options.add_force(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Flies, shows the flight, writes the report and prints a summary."""
    if not 5.0 <= args.seconds <= 36000.0:
        raise InputError(f"--seconds {args.seconds:g}: expected 5 to 36000")
    aircraft = load_aircraft(args.aircraft)
    own_domain()
    scenario = LoopScenario(
        aircraft,
        args.aircraft,
        args.fail,
        args.seconds,
        args.adapt,
        args.turbulence,
        args.method,
        args.out,
        args.surfaces,
    )
    scenario.check_simulation()
    if args.fail and args.seconds <= ONSET:
        text = f"--seconds {args.seconds:g}: the failure begins at {ONSET:g} s, after the flight"
        warnings.warn(f"{text}; fly longer, or give --fail ''", InputWarning, stacklevel=2)
    inputs, logs = options.inputs_of([], args.aircraft), [f"{node}.log" for node in NODES]
    with output_folder(args.out, "loop", inputs=inputs, force=args.force, working=logs) as out:
        flight = _fly(scenario)
        out.publish(lambda folder: write_loop_folder(folder, flight))
    print(_summary(scenario, flight))


def _fly(scenario: LoopScenario) -> ClosedLoopFlight:
    """Start the nodes and fly."""
    import rclpy  # noqa: PLC0415  # reads its domain from the environment
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415

    from sysid_node.ros.support.loop_watch import LoopWatch  # noqa: PLC0415

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    watch = LoopWatch()
    director = LoopDirector(scenario, watch)
    try:
        console = Console()
        with ExitStack() as stack:
            nodes = [stack.enter_context(node_process(n, scenario.arguments(n), scenario.out)) for n in NODES]
            with Live(console=console, auto_refresh=False) as live:
                while watch.time < scenario.seconds and all(node.poll() is None for node in nodes):
                    director.step()
                    live.update(loop_table(scenario, watch), refresh=True)
            console.print()
    finally:
        watch.close()
        rclpy.try_shutdown()
    return _recorded(scenario, watch, director.events)


def _recorded(scenario: LoopScenario, watch: LoopWatch, events: list[Event]) -> ClosedLoopFlight:
    """The flight as the watch recorded it."""
    return ClosedLoopFlight(
        aircraft=scenario.aircraft.name,
        failure=scenario.fail,
        onset=ONSET,
        adapted=scenario.adapt,
        time=[time for time, _ in watch.tracking],
        errors={axis: [row[f"{axis} error"] for _, row in watch.tracking] for axis in ("pitch", "roll", "sideslip")},
        commanded={axis: [row[axis] for _, row in watch.tracking] for axis in ("pitch", "roll")},
        estimates=dict(watch.estimates.derivatives) if watch.estimates else {},
        events=events,
        troubles=watch.troubles(),
    )


def _summary(scenario: LoopScenario, flight: ClosedLoopFlight) -> str:
    """Tracking errors before and after the failure, and the faults found."""
    lines = [f"{'adaptive' if scenario.adapt else 'fixed'} gains; tracking error (pitch, roll), rms:"]
    for name, start, stop in flight.spans(SETTLED):
        errors = (math.degrees(flight.rms(axis, start, stop)) for axis in ("pitch", "roll"))
        lines.append(f"  {name}: " + ", ".join(f"{error:.2f} deg" for error in errors))
    lines += [f"  fault reported at {alarm.time:.1f} s: {alarm.text}" for alarm in flight.alarms]
    return "\n".join([*lines, f"report: {scenario.out / 'report.html'}"])
