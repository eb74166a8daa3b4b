"""``sysid simulate``: records a simulated flight as a bag, and writes the truth beside it."""

from __future__ import annotations

import argparse
import json
import os
import shlex
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.cli.shared import options
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.bag.writer import STORAGES, write_streams
from sysid_node.flight.commands import COMMANDS, POSITIONS
from sysid_node.flight.frames import BODY_FRAMES
from sysid_node.flight.streams import JointStream, Streams
from sysid_node.flight.truth import truth_path
from sysid_node.report.files.outputs.output_file import output_bag

if TYPE_CHECKING:
    from sysid_node.excite.manoeuvre import Manoeuvre
    from sysid_node.sim.flying.recording import FlightSampler
    from sysid_node.sim.flying.sortie import Sortie
    from sysid_node.sim.simulator import Simulator

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

#: Rate of the integration, Hz; raised to the IMU's where that is higher. Commands that are held jump within a step, so
#: that their time is right to half of it.
_RATE, _HELD_RATE = 200.0, 1000.0
#: Attitude loops of the autopilot: the simulator's own, or those of others with their default gains.
LOOPS = ("own", "px4", "ardupilot")
#: Height above the ground (m) where none is given, for turbulence.
_HEIGHT = 100.0
#: Multiple of the file's noise where none is given.
_NOISE = 1.0
#: Memory of a step of the integration with its outputs and messages, as measured on flights of 3 and 10 minutes.
_BYTES_A_STEP = 1000.0
#: Flow angle (rad) beyond which no file's derivatives describe the flight.
_TUMBLED = np.pi / 4
#: Failures that reduce the effect of a surface; a stuck surface does so relative to its command.
LOSSES = ("control_effectiveness_loss", "stuck_surface")
#: Effects that begin at a time, with the parameter that says when.
_BEGINNINGS = {**dict.fromkeys(LOSSES, "onset"), "gust": "start"}


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("simulate", help="fly a simulated aircraft into a bag", description=__doc__)
    add = parser.add_argument
    add("--aircraft", required=True, help="file or name")
    add("--manoeuvre", action="append", default=[], metavar="SPEC", help="e.g. 3211, or 3211:elevator:amplitude=0.05")
    add(
        "--effect",
        action="append",
        default=[],
        metavar="NAME:KEY=VALUE",
        help="an effect of the aircraft flown",
    )
    add("--out", metavar="BAG", type=Path, required=True, help="folder of the bag, which must not exist")
    options.add_force(parser)
    add("--seed", type=int, default=0, help="of turbulence, noise and jitter (default: 0)")
    add("--duration", type=float, help="s (default: until 3 s after the manoeuvre; 60 s without one)")
    add("--airspeed", type=float, help="m/s (default: the aircraft's reference)")
    add("--turbulence", default="none", help="none, light, moderate or severe (default: none)")
    add("--height", type=float, default=_HEIGHT, help="m above the ground, for turbulence (default: 100)")
    add("--linear-gusts", action="store_true", help="turbulence without rotation of the air")
    held = parser.add_mutually_exclusive_group().add_argument
    held("--open-loop", dest="autopilot", action="store_false", help="without the autopilot")
    held("--autopilot", action="store_true", default=True, help="hold attitude and airspeed (default)")
    add("--loops", choices=LOOPS, default=LOOPS[0], help="the autopilot's attitude loops (default: own, softer ones)")
    add("--noise", type=float, default=_NOISE, help="of the aircraft file's sensor noise (default: 1)")
    add("--rate", type=float, default=200.0, help="of the IMU, Hz (default: 200)")
    add("--air-data-rate", type=float, default=100.0, help="Hz (default: 100)")
    add("--actuator-rate", type=float, default=100.0, help="Hz (default: 100)")
    add("--surfaces", choices=["commanded", "measured"], default="commanded", help="which deflections are recorded")
    add("--storage", choices=list(STORAGES), default="mcap", help="default: mcap")
    add("--body-frame", choices=BODY_FRAMES, default="flu", help="of the IMU messages (default: flu, REP-103)")
    add("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Flies, then writes the bag and the truth."""
    inputs = options.inputs_of([], args.aircraft)
    with output_bag(args.out, inputs, force=args.force, truth=True) as bag:
        sortie, streams, beside = _fly(args)
        write_streams(bag, streams, args.storage, args.body_frame, beside)
        truth_path(bag).write_text(json.dumps(_truth(args, sortie), indent=2) + "\n", encoding="utf-8")
    if not args.quiet:
        print(_summary(args.out, sortie, streams))
    _warn(sortie)


def _fly(args: argparse.Namespace) -> tuple[Sortie, Streams, dict[str, JointStream]]:
    """The flight and its messages, with those of ``_beside``."""
    from sysid_node.excite.manoeuvre import check_thrust  # noqa: PLC0415  # JAX takes its time
    from sysid_node.sim.flying import attitude_loops  # noqa: PLC0415
    from sysid_node.sim.flying.recording import FlightSampler  # noqa: PLC0415
    from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie  # noqa: PLC0415
    from sysid_node.sim.simulator import Simulator  # noqa: PLC0415

    if not 0.0 < args.height <= 20_000.0:
        raise InputError(f"--height {args.height:g}: expected more than 0 and at most 20000 m above the ground")
    if not 0 <= args.seed < 2**63:
        raise InputError(f"--seed {args.seed}: expected a whole number, 0 or more")
    aircraft = load_aircraft(args.aircraft)
    _check_options(args, aircraft)
    recorder = FlightSampler(args.rate, args.air_data_rate, args.actuator_rate, surfaces=args.surfaces)
    command_rate = args.actuator_rate if args.surfaces == "commanded" else None
    rate = max(_HELD_RATE if command_rate else _RATE, args.rate, command_rate or 0.0)
    simulator = Simulator(aircraft, rate)
    conditions = SortieConditions(
        args.effect,
        args.airspeed,
        args.turbulence,
        args.height,
        args.autopilot,
        args.noise,
        args.seed,
        rotary_gusts=not args.linear_gusts,
        command_rate=command_rate,
        loops=attitude_loops.LOOPS.get(args.loops),
    )
    _check_memory(args.duration, rate)
    plan = _plan(args, simulator, command_rate or rate)
    sortie = fly_sortie(simulator, _deflections(args, simulator, plan), conditions)
    if plan is not None:
        check_thrust(plan, aircraft, np.asarray(sortie.inputs.commands)[:, -1])
    return sortie, recorder.record(sortie), _beside(recorder, sortie)


def _beside(recorder: FlightSampler, sortie: Sortie) -> dict[str, JointStream]:
    """What the topic ``actuators`` does not carry, positions or commands, by its own topic."""
    if recorder.surfaces == "measured":
        return {COMMANDS: recorder.commands(sortie)}
    return {POSITIONS: replace(recorder, surfaces="measured").record(sortie).actuators}


def _check_options(args: argparse.Namespace, aircraft: Aircraft) -> None:
    """Raise InputError where an option would change nothing: an effect states it, or there is no turbulence.

    The usual height is no such option: the command that a flight's truth holds states every default.
    """
    from sysid_node.sim.model.parameters import parse  # noqa: PLC0415

    stated = parse(args.effect)
    for option, given, effect, key in (
        (f"--turbulence {args.turbulence}", args.turbulence != "none", "turbulence", "intensity"),
        (f"--noise {args.noise:g}", args.noise != _NOISE, "sensor_noise", "scale"),
    ):
        if given and key in stated.get(effect, {}):
            raise InputError(f"{option}: --effect {effect} states {key}, too; give one of them")
    if args.loops != LOOPS[0] and not args.autopilot:
        raise InputError(f"--loops {args.loops}: --open-loop flies without the autopilot; give one of them")
    if args.turbulence != "none" or "turbulence" in stated or "turbulence" in aircraft.effects:
        return
    said = "--linear-gusts" if args.linear_gusts else f"--height {args.height:g}" if args.height != _HEIGHT else ""
    if said:
        raise InputError(f"{said}: there is no turbulence that it changes; give --turbulence, or leave it out")


def _check_memory(duration: float | None, rate: float) -> None:
    """Raise InputError where a flight of this duration (s), integrated at a rate (Hz), has no room on this machine."""
    needed = (duration or 0.0) * rate * _BYTES_A_STEP
    there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > there:
        raise InputError(
            f"--duration {duration:g}: takes about {needed / 1e9:.0f} GB of memory at {rate:g} steps a second, and "
            f"this machine has {there / 1e9:.0f}; fly several shorter flights"
        )


def _plan(args: argparse.Namespace, simulator: Simulator, command_rate: float) -> Manoeuvre | None:
    """The manoeuvre, of which no step is lost between commands at a rate (Hz); None where none is flown."""
    from sysid_node.excite.segment import check_sampling, draw_manoeuvre  # noqa: PLC0415
    from sysid_node.excite.spec import parse_segments  # noqa: PLC0415

    duration = args.duration
    if duration is not None and not 0.1 <= duration <= 36000.0:
        raise InputError(f"--duration {duration:g}: expected 0.1 to 36000 s")
    if not args.manoeuvre:
        return None
    segments = parse_segments(args.manoeuvre, simulator.aircraft, args.airspeed)
    check_sampling(segments, command_rate)
    return draw_manoeuvre(segments, simulator.aircraft, simulator.rate, duration)


def _deflections(args: argparse.Namespace, simulator: Simulator, manoeuvre: Manoeuvre | None) -> NDArray[np.float64]:
    """Planned deflections from trim (N, controls + 1), rad and N."""
    if manoeuvre is None:
        return np.zeros((round((args.duration or 60.0) * simulator.rate) + 1, len(simulator.commands)))
    return np.column_stack([manoeuvre.surfaces(), _thrust(simulator, manoeuvre)])


def _thrust(simulator: Simulator, manoeuvre: Manoeuvre) -> NDArray[np.float64]:
    """Planned thrust from trim (N,), N."""
    from sysid_node.excite.manoeuvre import THROTTLE  # noqa: PLC0415

    throttle = simulator.aircraft.throttle
    if throttle is None:
        return np.zeros(manoeuvre.time.size)
    return manoeuvre.deflections[THROTTLE] * (throttle.max_thrust or 1.0)


def _truth(args: argparse.Namespace, sortie: Sortie) -> dict[str, Any]:
    """The content of ``BAG.truth.json``: derivatives, effects, trim and the command."""
    derivatives, changes = _derivatives(args.surfaces, sortie)
    return {
        "aircraft": sortie.simulator.aircraft.name,
        "derivatives": derivatives,
        "changes": changes,
        "effects": sortie.all_effects,
        "trim": {
            "airspeed": float(np.linalg.norm(sortie.trim.initial[3:6])),
            "alpha": sortie.trim.alpha,
            "command": dict(zip(sortie.simulator.commands, sortie.trim.command.tolist(), strict=True)),
        },
        "manoeuvre": args.manoeuvre,
        "autopilot": args.autopilot,
        "turbulence": args.turbulence,
        "seed": args.seed,
        "recorded_surfaces": args.surfaces,
        "command": _command(args),
    }


def _derivatives(surfaces: str, sortie: Sortie) -> tuple[dict[str, float], list[dict[str, Any]]]:
    """The true derivatives at the beginning, and their changes by failures of surfaces with the times of these.

    They belong to the deflections that are recorded: if the position of a stuck surface is measured, its derivatives
    do not change; if its command is recorded, they become zero.
    """
    lossy = LOSSES[:1] if surfaces == "measured" else LOSSES
    failed = sorted((effect.get("onset", 0.0), name) for name, effect in sortie.all_effects.items() if name in lossy)
    end = (len(sortie.flight.outputs) - 1) * sortie.simulator.step
    begin, changes = dict(sortie.derivatives), []
    present = begin
    for onset, name in failed:
        changed = _left(sortie, name, present)
        present = present | changed
        if onset <= 0.0:
            begin = present
        elif onset < end:
            changes.append({"time": onset, "derivatives": changed})
    return begin, changes


def _left(sortie: Sortie, effect: str, derivatives: Mapping[str, float]) -> dict[str, float]:
    """The derivatives that a failure changes, as they are after it."""
    lost = sortie.all_effects[effect]
    share = {c.symbol: 1.0 - lost[n] for n, c in sortie.simulator.aircraft.controls.items() if lost.get(n)}
    of = {name: name.partition("_")[2] for name in derivatives}
    return {name: share[of[name]] * value for name, value in derivatives.items() if of[name] in share}


def _command(args: argparse.Namespace) -> str:
    """The command that repeats this flight, with all defaults; the bag is named without its folder."""
    words = ["sysid", "simulate"]
    for name, value in {**vars(args), "out": args.out.name}.items():
        option = f"--{name.replace('_', '-')}"
        if isinstance(value, list):
            words += [word for item in value for word in (option, item)]
        elif isinstance(value, bool):  # --force and --quiet are not part of what was flown
            words += ["--open-loop"] if name == "autopilot" and not value else []
            words += ["--linear-gusts"] if name == "linear_gusts" and value else []
        elif name == "loops":
            words += [option, value] if value != LOOPS[0] else []
        elif value is not None and name != "command":
            words += [option, str(value)]
    return shlex.join(words)


def _warn(sortie: Sortie) -> None:
    """Warn (InputWarning) of effects that begin after the flight, and of a flight that no derivatives describe."""
    outputs = np.asarray(sortie.flight.outputs)
    end = (len(outputs) - 1) * sortie.simulator.step
    for effect, key in _BEGINNINGS.items():
        begin = sortie.effects.get(effect, {}).get(key, -np.inf)
        if begin >= end:
            text = f"effect {effect}: {key}={begin:g} s is not within the flight of {end:g} s, so that it does nothing"
            warnings.warn(text, InputWarning, stacklevel=2)
    for angle, words in (("alpha", "angle of attack"), ("beta", "sideslip")):
        largest = float(np.abs(outputs[:, sortie.simulator.outputs.index(angle)]).max())
        if largest > _TUMBLED:
            text = f"the {words} reaches {np.rad2deg(largest):.0f} deg, where derivatives do not describe the flight"
            warnings.warn(f"{text}; use smaller deflections or effects", InputWarning, stacklevel=2)
            break


def _summary(bag: Path, sortie: Sortie, streams: Streams) -> str:
    """One line: the bag, its duration, its messages and the range of the angle of attack."""
    outputs = np.asarray(sortie.flight.outputs)
    alpha = np.rad2deg(outputs[:, sortie.simulator.outputs.index("alpha")])
    counts = ", ".join(f"{len(stream.arrival)} on {topic}" for topic, stream in streams.by_topic.items())
    seconds = (len(outputs) - 1) * sortie.simulator.step
    return f"{bag}: {seconds:.1f} s, {counts}; alpha {alpha.min():.1f} to {alpha.max():.1f} deg"
