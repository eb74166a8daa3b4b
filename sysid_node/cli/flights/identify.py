"""``sysid identify``: identifies an aircraft from whole flights by a batch method."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.api.flight_file import load
from sysid_node.api.identification import identify
from sysid_node.batch.identify import METHODS
from sysid_node.batch.settings import BatchSettings
from sysid_node.cli.shared import options
from sysid_node.cli.shared.terminal import progress_bar, show_estimates
from sysid_node.report.files.outputs.output_folder import output_folder

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("identify", help="identify an aircraft from bags with a batch method")
    parser.description = "Identify an aircraft from whole flights; writes summary.json, tables and report.html."
    parser.add_argument("bag", metavar="BAG", nargs="+", type=Path, help=options.LOG_HELP)
    options.add_aircraft(parser)
    parser.add_argument("--method", required=True, choices=METHODS, help="how to estimate")
    options.add_out(parser)
    options.add_holdout(parser)
    known = ", ".join(field.name for field in fields(BatchSettings))
    options.add_settings(parser, f"a setting: {known}", "frequency_equation_error")
    options.add_reading(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Identifies from the flights and writes the results."""
    options.refuse_twice([*args.bag, *args.holdout])
    flights, holdout = (
        [load(path, args.aircraft, topics=args.topic, body_frame=args.body_frame) for path in paths]
        for paths in (args.bag, args.holdout)
    )
    settings = options.settings_of(args.set, args.frequencies, "segment=10")
    inputs = options.inputs_of([*args.bag, *args.holdout], args.aircraft)
    with output_folder(args.out, "identify", inputs=inputs, force=args.force) as out:
        with progress_bar("identify", quiet=args.quiet) as progress:
            found = identify(flights, args.method, settings, holdout=holdout, progress=progress)
        out.publish(found.write)
    if not args.quiet:
        show_estimates(found.run.history[-1], found.run.references.truth)
        print(args.out / "report.html")
