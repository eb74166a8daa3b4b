"""``sysid excite``: draw a manoeuvre, say what it would tell about an aircraft, and shape it to tell more."""

from __future__ import annotations

import argparse
import json
import math
import shutil
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid_node.aircraft.document import did_you_mean
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.shared.terminal import progress_bar
from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.logs import streams_of

if TYPE_CHECKING:
    from sysid_node.excite.manoeuvre import Manoeuvre
    from sysid_node.excite.optimise import FlightEnvelope
    from sysid_node.excite.prediction import Predictor
    from sysid_node.excite.spec import Segment
    from sysid_node.report.results.manoeuvre_result import ManoeuvreResult

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

FLIGHT_BAG = "flight"


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("excite", help="design a manoeuvre and tell what it would show", description=__doc__)
    add = parser.add_argument
    add("--aircraft", required=True, metavar="FILE|NAME", help="aircraft file, or name as in cdrw")
    add(
        "--manoeuvre", action="append", required=True, metavar="SPEC", help="e.g. 3211, or 3211:elevator:amplitude=0.05"
    )
    add("--out", required=True, metavar="DIR", type=Path, help="folder for the results")
    add("--rate", type=float, default=100.0, help="samples a second (default: 100)")
    add("--duration", type=float, help="s (default: until 3 s after the manoeuvre)")
    add("--airspeed", type=float, help="m/s (default: the aircraft's reference)")
    add("--open-loop", action="store_true", help="without the autopilot that holds attitude and airspeed")
    add("--optimise", action="store_true", help="shape amplitudes and timing for the least predicted error")
    add("--evaluations", type=int, default=200, help="trials of the optimiser (default: 200)")
    add("--envelope", action="append", default=[], metavar="NAME=VALUE", help="limit of a departure from trim")
    add("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Predicts, optimises where asked to, and writes."""
    result = design(args)
    write_design(args.out, result)
    if not args.quiet:
        print(result.prediction.manoeuvre.spec)
        print(args.out / "report.html")


def design(args: argparse.Namespace) -> ManoeuvreResult:
    """The manoeuvre with its prediction. Raises InputError."""
    from sysid_node.excite.prediction import Predictor  # noqa: PLC0415  # JAX takes its time
    from sysid_node.excite.spec import draw_manoeuvre, parse_segments  # noqa: PLC0415
    from sysid_node.report.results.manoeuvre_result import ManoeuvreResult  # noqa: PLC0415

    if not 10 <= args.evaluations <= 10_000:
        raise InputError(f"--evaluations {args.evaluations}: expected 10 to 10000")
    aircraft, envelope = load_aircraft(args.aircraft), parse_envelope(args.envelope)
    segments = parse_segments(args.manoeuvre, aircraft)
    plan = draw_manoeuvre(segments, aircraft, args.rate, args.duration)
    with progress_bar("excite", quiet=args.quiet) as progress:
        predictor = Predictor(aircraft, args.rate, args.airspeed, autopilot=not args.open_loop)
        if not args.optimise:
            return ManoeuvreResult(aircraft, predictor.predict(plan), envelope, not args.open_loop)
        return _optimised(args, predictor, segments, plan, envelope, progress)


def _optimised(
    args: argparse.Namespace,
    predictor: Predictor,
    segments: Sequence[Segment],
    plan: Manoeuvre,
    envelope: FlightEnvelope,
    progress: Callable[[float], None],
) -> ManoeuvreResult:
    from sysid_node.excite.optimise import optimise  # noqa: PLC0415
    from sysid_node.report.results.manoeuvre_result import ManoeuvreResult  # noqa: PLC0415

    tell = lambda count, _: progress(min(count / args.evaluations, 1.0))  # noqa: E731
    optimum = optimise(predictor, segments, plan.duration, envelope, args.evaluations, tell)
    return ManoeuvreResult(predictor.aircraft, optimum.best, envelope, not args.open_loop, optimum)


def parse_envelope(texts: Iterable[str]) -> FlightEnvelope:
    """Limits from ``name=value`` texts, the rest as they are by default. Raises InputError."""
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


def write_design(folder: Path, result: ManoeuvreResult) -> None:
    """Write manoeuvre.csv, prediction.csv, correlations.csv, summary.json, report.html and the bag ``flight``.

    What an earlier run left there is replaced. Raises InputError where the folder cannot be written.
    """
    from sysid_node.report.pages.manoeuvre_page import write_manoeuvre_report  # noqa: PLC0415

    try:
        folder.mkdir(parents=True, exist_ok=True)
        _remove_old_bag(folder / FLIGHT_BAG)
        _write_tables(folder, result)
        text = json.dumps(summary(result), indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
        write_manoeuvre_report(folder / "report.html", result)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error}; give another folder as --out") from error
    write_streams(folder / FLIGHT_BAG, streams_of(result.prediction.flight, result.aircraft))


def summary(result: ManoeuvreResult) -> dict[str, Any]:
    """The content of ``summary.json``; a derivative that the flight does not show has no standard error: null."""
    information, plan = result.prediction.information, result.prediction.manoeuvre
    errors = (None if math.isinf(error) else error for error in information.standard_errors.tolist())
    tolerances = (derivative.tolerance for derivative in result.aircraft.derivatives.values())
    rows = zip(information.names, information.values.tolist(), tolerances, errors, strict=True)
    content = {
        "aircraft": result.aircraft.name,
        "manoeuvre": plan.spec,
        "duration": plan.duration,
        "autopilot": result.autopilot,
        "largest_deflections": {name: float(np.abs(plan.deflections[name]).max()) for name in plan.moved},
        "envelope_excess": result.envelope.excess(result.prediction.flight),
        "derivatives": {name: {"value": v, "tolerance": t, "standard_error": e} for name, v, t, e in rows},
        "correlated": [{"pair": [a, b], "correlation": c} for a, b, c in information.pairs()],
    }
    if result.optimum is not None:
        content["optimisation"] = {
            "start": result.optimum.start.manoeuvre.spec,
            "left_start": result.optimum.cost_start,
            "left_best": result.optimum.cost_best,
            "counted": list(result.optimum.counted),
            "evaluations": result.optimum.evaluations,
        }
    return content


def _write_tables(folder: Path, result: ManoeuvreResult) -> None:
    plan, information = result.prediction.manoeuvre, result.prediction.information
    times = zip(plan.time.tolist(), *(values.tolist() for values in plan.deflections.values()), strict=True)
    write_table(folder / "manoeuvre.csv", ["t", *plan.deflections], times)
    tolerances = [d.tolerance for d in result.aircraft.derivatives.values()]
    numbers = (information.values.tolist(), tolerances, information.standard_errors.tolist())
    rows = zip(information.names, *numbers, strict=True)
    write_table(folder / "prediction.csv", ["name", "value", "tolerance", "standard_error"], rows)
    matrix = zip(information.names, *information.correlations.T.tolist(), strict=True)
    write_table(folder / "correlations.csv", ["name", *information.names], matrix)


def _remove_old_bag(bag: Path) -> None:
    """Removes the bag of an earlier run, and nothing else."""
    if not bag.exists():
        return
    strangers = {file.name for file in bag.iterdir()} - {"metadata.yaml", f"{FLIGHT_BAG}.mcap"}
    if strangers:
        raise InputError(f"{bag}: holds {min(strangers)}, which sysid excite did not write; give another --out")
    shutil.rmtree(bag)
