"""``sysid fleet``: identifies many flights of many aircraft on Dask's workers, and says what they tell together."""

from __future__ import annotations

import argparse
import os
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.cli.shared import options
from sysid_node.cli.shared.terminal import progress_bar
from sysid_node.errors import InputError

if TYPE_CHECKING:
    from sysid_node.fleet.outcome import FleetSettings
    from sysid_node.fleet.plan import PlannedFlight
    from sysid_node.report.results.fleet_report import FleetReport

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

#: What the command needs besides the packages of every command.
_PACKAGES = ("dask", "distributed", "fsspec", "pyarrow")
_SHOWN = 10  # refusals, and warnings, that are printed; the tables hold all


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    meaning = "identify many flights of many aircraft, and say what they tell together"
    parser = commands.add_parser("fleet", help=meaning, description=__doc__)
    add = parser.add_argument
    add("catalogue", metavar="CATALOGUE", type=Path, help="CSV or YAML file of flights, or a folder of logs")
    options.add_out(parser, "; started again with the same folder, only what is missing or changed is done")
    add("--aircraft", metavar="FILE|NAME", help="aircraft of the flights for which the catalogue names none")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, metavar="N", help="worker processes here (default: one a processor)")
    where.add_argument("--scheduler", default="", metavar="ADDRESS", help="a Dask scheduler, as tcp://host:8786")
    add("--dry-run", action="store_true", help="list what would be done, and what is wrong with which flight")
    add("--method", default="", metavar="M", help="a batch method, as of sysid identify (default: the replay)")
    add("--gap", action="store_true", help="diagnose each flight as sysid gap does; its report lies in DIR/flights")
    add("--reports", action="store_true", help="write each flight's own report into DIR/flights, some MB each")
    options.add_settings(parser, "any node parameter, or setting of the method", "the transform")
    add("--time-limit", type=float, default=3600.0, metavar="S", help="that a flight may take (default: 3600)")
    add("--retries", type=int, default=1, metavar="N", help="attempts after one whose worker died (default: 1)")
    add("--memory", metavar="SIZE", help="of a worker, e.g. 2GB (default: its share of the machine's)")
    add("--cache", metavar="DIR", type=Path, help="folder for copies of remote logs (default: the user's cache)")
    options.add_reading(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Works through the fleet and writes the results, or lists what would be done."""
    missing = [name for name in _PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(f"needs {', '.join(missing)}, not installed; run: pip install -r requirements/fleet.txt")
    _check_numbers(args)
    from sysid_node.api import fleet_run  # noqa: PLC0415  # Dask takes its time
    from sysid_node.fleet.catalogue.reading import read_catalogue  # noqa: PLC0415
    from sysid_node.fleet.engine.cluster import check_memory  # noqa: PLC0415
    from sysid_node.fleet.engine.running import Limits  # noqa: PLC0415

    check_memory(args.memory)
    settings = _settings(args)
    catalogue = read_catalogue(args.catalogue, args.aircraft)
    if args.dry_run:
        with fleet_run.planned(catalogue, args.out, settings) as flights:
            _show_plan(list(flights))
        return
    inputs = [] if args.catalogue.is_dir() else [args.catalogue]
    workers = fleet_run.WorkersWanted(args.workers or len(os.sched_getaffinity(0)), args.scheduler, args.memory)
    with progress_bar("fleet", quiet=args.quiet) as progress:
        found = fleet_run.run_fleet(
            catalogue,
            args.out,
            settings,
            workers,
            limits=Limits(args.time_limit, args.retries),
            cache=args.cache,
            force=args.force,
            inputs=options.inputs_of(inputs, args.aircraft),
            say=lambda link: None if args.quiet else print(f"workers: {link}", flush=True),
            progress=progress,
        )
    if not args.quiet:
        _show(found, args.out)
    fleet_run.require_results(found.results)


def _check_numbers(args: argparse.Namespace) -> None:
    if args.workers is not None and not 1 <= args.workers <= 1000:
        raise InputError(f"--workers {args.workers}: expected 1 to 1000")
    if not 0.0 < args.time_limit < 1e7:
        raise InputError(f"--time-limit {args.time_limit:g}: expected a number of seconds")
    if not 0 <= args.retries <= 100:
        raise InputError(f"--retries {args.retries}: expected 0 to 100")


def _settings(args: argparse.Namespace) -> FleetSettings:
    from sysid_node.fleet.outcome import FleetSettings  # noqa: PLC0415

    return FleetSettings(
        method=args.method,
        settings=options.settings_of(args.set, args.frequencies, "window=20"),
        gap=args.gap,
        reports=args.reports,
        topics=tuple(args.topic),
        body_frame=args.body_frame,
    )


def _show_plan(flights: list[PlannedFlight]) -> None:
    """Print a line for each flight: what would be done, or what is wrong with it."""
    rows = [("flight", "tail", "aircraft", "date", "what would be done")]
    counts: Counter[str] = Counter()
    for flight in flights:
        entry = flight.entry
        what = "nothing, it is done" if flight.done else entry.fault or "identify"
        counts["wrong" if entry.fault else "done" if flight.done else "to do"] += 1
        date = entry.date.date().isoformat() if entry.date else "the log's"
        rows.append((entry.flight, entry.tail or "the log's", Path(entry.aircraft).name, date, what))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        print("  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())
    print(f"{counts['to do']} to do, {counts['done']} done, {counts['wrong']} with a fault")


def _show(found: FleetReport, out: Path) -> None:
    """Print how many flights gave a result, why the others did not, and what the flights tell together."""
    from sysid_node.report.wording.fleet import findings  # noqa: PLC0415  # with the results there, it is quick
    from sysid_node.report.wording.numbers import plural  # noqa: PLC0415

    results = found.results
    tails = {(flight.aircraft, flight.tail) for flight in results.flights}
    print(f"{plural(len(results.flights), 'flight')} of {len(tails)} aircraft, {len(results.refusals)} refused")
    for refusal in results.refusals[:_SHOWN]:
        print(f"  refused {refusal.flight}: {refusal.reason.removeprefix(f'{refusal.flight}: ')}")
    if len(results.refusals) > _SHOWN:
        print(f"  and {len(results.refusals) - _SHOWN} more in {out / 'refusals.csv'}")
    remarks = [(flight.flight, remark) for flight in results.flights for remark in flight.remarks]
    for flight, remark in remarks[:_SHOWN]:
        print(f"  warning of {flight}: {remark}")
    if len(remarks) > _SHOWN:
        print(f"  and {len(remarks) - _SHOWN} more warnings in {out / 'flights.csv'}")
    for sentence in findings(found):
        print(sentence)
    print(out / "report.html")
