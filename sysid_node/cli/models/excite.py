"""``sysid excite``: designs a manoeuvre, predicts the standard errors that it allows, and optimises it."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.shared import options
from sysid_node.cli.shared.terminal import progress_bar
from sysid_node.errors import InputError
from sysid_node.report.files.outputs.output_folder import output_folder
from sysid_node.suggestion import did_you_mean

if TYPE_CHECKING:
    from sysid_node.excite.manoeuvre import Manoeuvre
    from sysid_node.excite.optimise import FlightEnvelope
    from sysid_node.excite.prediction import Predictor
    from sysid_node.excite.segment import ManoeuvreSegment
    from sysid_node.report.results.manoeuvre_result import ManoeuvreResult

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


#: Trials of the optimiser, where none are given.
_EVALUATIONS = 200


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("excite", help="design a manoeuvre and predict its accuracy", description=__doc__)
    add = parser.add_argument
    add("--aircraft", required=True, metavar="FILE|NAME", help="aircraft file, or name as in cdrw")
    add(
        "--manoeuvre", action="append", required=True, metavar="SPEC", help="e.g. 3211, or 3211:elevator:amplitude=0.05"
    )
    options.add_out(parser)
    add("--rate", type=float, default=100.0, help="samples a second (default: 100)")
    add("--duration", type=float, help="s (default: until 3 s after the manoeuvre)")
    add("--airspeed", type=float, help="m/s (default: the aircraft's reference)")
    add("--open-loop", action="store_true", help="without the autopilot that holds attitude and airspeed")
    add("--optimise", action="store_true", help="optimise amplitudes and timing for the smallest predicted errors")
    add("--evaluations", type=int, help=f"trials of --optimise (default: {_EVALUATIONS})")
    add("--envelope", action="append", default=[], metavar="NAME=VALUE", help="limit of a departure from trim")
    add("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Predicts, optimises with ``--optimise``, and writes the results."""
    from sysid_node.report.files.manoeuvre_folder import write_manoeuvre  # noqa: PLC0415  # JAX takes its time
    from sysid_node.report.sections.manoeuvre.plan import beyond_envelope  # noqa: PLC0415
    from sysid_node.report.sections.manoeuvre.prediction import hardly_seen  # noqa: PLC0415

    inputs = options.inputs_of([], args.aircraft)
    with output_folder(args.out, "excite", inputs=inputs, force=args.force) as out:
        result = design(args)
        out.publish(lambda folder: write_manoeuvre(folder, result))
    if not args.quiet:
        print(result.prediction.manoeuvre.spec)
        if exceeded := beyond_envelope(result):
            print(f"The flight exceeds the envelope in {', '.join(exceeded)}.")
        if unseen := hardly_seen(result):
            print(f"It tells hardly more than the aircraft file of {', '.join(unseen)}.")
        print(args.out / "report.html")


def design(args: argparse.Namespace) -> ManoeuvreResult:
    """The manoeuvre with its prediction. Raises InputError."""
    from sysid_node.excite.prediction import Predictor  # noqa: PLC0415  # JAX takes its time
    from sysid_node.excite.segment import draw_manoeuvre  # noqa: PLC0415
    from sysid_node.excite.spec import parse_segments  # noqa: PLC0415
    from sysid_node.report.results.manoeuvre_result import ManoeuvreResult  # noqa: PLC0415

    _check_evaluations(args)
    aircraft, envelope = load_aircraft(args.aircraft), parse_envelope(args.envelope)
    segments = parse_segments(args.manoeuvre, aircraft, args.airspeed)
    plan = draw_manoeuvre(segments, aircraft, args.rate, args.duration)
    with progress_bar("excite", quiet=args.quiet) as progress:
        predictor = Predictor(aircraft, args.rate, args.airspeed, autopilot=not args.open_loop)
        if not args.optimise:
            return ManoeuvreResult(aircraft, predictor.predict(plan), envelope, not args.open_loop)
        return _optimised(args, predictor, segments, plan, envelope, progress)


def _check_evaluations(args: argparse.Namespace) -> None:
    if args.evaluations is None:
        return
    if not 10 <= args.evaluations <= 10_000:
        raise InputError(f"--evaluations {args.evaluations}: expected 10 to 10000")
    if not args.optimise:
        raise InputError(f"--evaluations {args.evaluations}: nothing is optimised; give --optimise, or leave it out")


def _optimised(
    args: argparse.Namespace,
    predictor: Predictor,
    segments: Sequence[ManoeuvreSegment],
    plan: Manoeuvre,
    envelope: FlightEnvelope,
    progress: Callable[[float, str], None],
) -> ManoeuvreResult:
    from sysid_node.excite.optimise import optimise  # noqa: PLC0415
    from sysid_node.report.results.manoeuvre_result import ManoeuvreResult  # noqa: PLC0415

    trials = args.evaluations or _EVALUATIONS
    tell = lambda count, _: progress(min(count / trials, 1.0), "optimising")  # noqa: E731
    optimum = optimise(predictor, segments, plan.duration, envelope, trials, tell)
    return ManoeuvreResult(predictor.aircraft, optimum.best, envelope, not args.open_loop, optimum)


def parse_envelope(texts: Iterable[str]) -> FlightEnvelope:
    """The envelope from ``name=value`` texts; other limits have their defaults. Raises InputError."""
    from sysid_node.excite.optimise import FlightEnvelope  # noqa: PLC0415

    known = tuple(FlightEnvelope.__dataclass_fields__)
    values: dict[str, float] = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if name not in known:
            raise InputError(f"--envelope {text!r}: expected one of {', '.join(known)}{did_you_mean(name, known)}")
        try:
            values[name] = float(value)
        except ValueError:
            values[name] = math.nan
        if not 0 < values[name] < math.inf:
            raise InputError(f"--envelope {text!r}: expected {name}=VALUE, above zero (rad, rad/s, or a share)")
    return FlightEnvelope(**values)
