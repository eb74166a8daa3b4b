"""``sysid gap``: where the simulator and the flight differ, which effect causes it, and how far the gap shrinks."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.flight.frames import BODY_FRAMES
from sysid_node.flight.topics import topic_names

if TYPE_CHECKING:
    from sysid_node.gap.diagnose import Diagnosis

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser(
        "gap", help="find why the simulator does not fly like the aircraft", description=__doc__
    )
    add = parser.add_argument
    add("bags", metavar="BAG", type=Path, nargs="+", help="rosbag2 folder, .mcap, .db3 or .csv file")
    add("--aircraft", required=True, metavar="FILE|NAME", help="aircraft file, or name as in cdrw: the belief")
    add("--holdout", action="append", default=[], metavar="BAG", type=Path, help="a flight to check on, not to fit")
    add(
        "--out",
        required=True,
        metavar="DIR",
        type=Path,
        help="folder for the results; an interrupted run, started again with the same folder, goes on where it stopped",
    )
    add("--topic", action="append", default=[], metavar="OURS:=THEIRS", help="a topic's name in the bags")
    add("--body-frame", choices=BODY_FRAMES, default="flu", help="of the IMU messages (default: flu)")
    add("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Diagnoses and writes."""
    from sysid_node.gap.diagnose import diagnose  # noqa: PLC0415  # JAX takes its time
    from sysid_node.gap.flightdata.gap_flight import load_gap_flight  # noqa: PLC0415
    from sysid_node.report.pages.gap_page import opening_text  # noqa: PLC0415

    aircraft, topics = load_aircraft(args.aircraft), topic_names(args.topic)
    flights, holdouts = (
        [load_gap_flight(path, aircraft, topics, args.body_frame) for path in paths]
        for paths in (args.bags, args.holdout)
    )
    with _progress(quiet=args.quiet) as progress:
        found = diagnose(aircraft, flights, holdouts, progress, keep=args.out / "unfinished")
    write_gap(args.out, found)
    if not args.quiet:
        print(opening_text(found))
        print(args.out / "report.html")


@contextmanager
def _progress(*, quiet: bool) -> Iterator[Callable[[float, str], None]]:
    """A bar on stderr that says what is being done; nothing where ``quiet`` or where stderr is a file."""
    columns = (BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as progress:
        task = progress.add_task("reading the flights", total=1.0)
        yield lambda share, doing: progress.update(task, completed=share, description=doing)


def write_gap(folder: Path, found: Diagnosis) -> None:
    """Writes gap.json, where.csv, candidates.csv, corrected.yaml, effects.txt and report.html. Raises InputError."""
    from sysid_node.gap.document import document  # noqa: PLC0415
    from sysid_node.report.pages.gap_page import write_gap_report  # noqa: PLC0415

    content = document(found)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "gap.json").write_text(text + "\n", encoding="utf-8")
        write_table(folder / "where.csv", ["station", "axis", "share"],
                   [[w["station"], w["axis"], w["share"]] for w in found.where])  # fmt: skip
        write_table(folder / "candidates.csv", ["effect", "probability", "share"],
                   [list(candidate.values()) for candidate in content["candidates"]])  # fmt: skip
        (folder / "corrected.yaml").write_text(dump_aircraft(corrected(found)), encoding="utf-8")
        (folder / "effects.txt").write_text("".join(f"--effect {e}\n" for e in effect_options(found)), encoding="utf-8")
        write_gap_report(folder / "report.html", found)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); give another folder as --out") from None


def corrected(found: Diagnosis) -> Aircraft:
    """The aircraft file with the derivatives as the flights have them, within their tolerances."""
    from dataclasses import replace  # noqa: PLC0415

    fit = found.attribution.corrected
    names, point = fit.models[0].simulator.names, fit.points[0]
    derivatives = {
        n: replace(d, value=float(d.value + point[names.index(f"derivative_error.{n}")]))
        for n, d in found.aircraft.derivatives.items()
    }
    return replace(found.aircraft, derivatives=derivatives)


def effect_options(found: Diagnosis) -> list[str]:
    """The causes as ``sysid simulate --effect`` takes them; the derivatives' errors are in the corrected file."""
    fit = found.attribution.corrected
    simulator = fit.models[0].simulator
    options = []
    for cause in found.attribution.causes:
        indices = cause.candidate.entries
        pairs = [f"{simulator.parameters[i][1].name}={fit.points[0][i]:.6g}" for i in indices]
        if cause.candidate.effect != "derivative_error":
            options.append(":".join([cause.candidate.effect, *pairs]))
    return options
