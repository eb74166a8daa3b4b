"""``sysid import``: another simulator's model as an aircraft file."""

from __future__ import annotations

import argparse
import math
import re
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import parse_aircraft
from sysid_node.cli.shared import options
from sysid_node.errors import InputError
from sysid_node.report.files.outputs.output_file import check_file, write_file

if TYPE_CHECKING:
    from sysid_node.sim.importing.imported import Imported

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

#: What stands near the beginning of every file that this command writes, by which a later run knows it.
MARK = "Written by sysid import"

FORMATS = ("jsbsim", "gazebo", "rosflight")


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    meaning = "read another simulator's model as an aircraft file"
    parser = commands.add_parser("import", help=meaning, description=__doc__)
    add = parser.add_argument
    add("model", metavar="MODEL", help="the model's file; of jsbsim also the name of an aircraft that comes with it")
    add("--format", choices=FORMATS, required=True, help="whose model")
    add("--out", metavar="FILE", type=Path, required=True, help="the aircraft file to write")
    add("--airspeed", type=float, metavar="V", help="of the level flight that the file is about, m/s (default: found)")
    add("--altitude", type=float, metavar="H", help="of that flight, m; jsbsim only (default: 1000)")
    options.add_force(parser)
    options.add_quiet(parser)
    return parser


def run(args: argparse.Namespace) -> None:
    """Reads the model and writes the aircraft file."""
    check_file(args.out, options.inputs_of([args.model], None), MARK, force=args.force)
    _check(args)
    imported = _read(args)
    text = _header(args, imported.notes) + dump_aircraft(imported.aircraft)
    _check_accepted(args, text)
    write_file(args.out, text)
    if not args.quiet:
        aircraft = imported.aircraft
        parts = f"{len(aircraft.derivatives)} derivatives, {len(aircraft.tables)} tables"
        reference = aircraft.reference
        about = f"level flight at {reference.airspeed:.1f} m/s, {reference.air_density:.3f} kg/m^3"
        print(f"{args.out}: {aircraft.name}, {parts} about {about}")
        for note in imported.notes:
            print(f"- {note}")


def _check_accepted(args: argparse.Namespace, text: str) -> None:
    """Raise InputError, naming the model, where an aircraft file does not accept what was read from it."""
    out = str(args.out)
    try:
        parse_aircraft(text, out)
    except InputError as error:
        problem = re.sub(rf"^{re.escape(out)}(:\d+)?: ", "", str(error))
        raise InputError(f"{args.model}: no aircraft file can hold it: {problem}") from error


def _check(args: argparse.Namespace) -> None:
    if args.airspeed is not None and not 1.0 <= args.airspeed <= 1000.0:
        raise InputError(f"--airspeed {args.airspeed:g}: expected 1 to 1000 m/s")
    if args.altitude is not None and args.format != "jsbsim":
        raise InputError(f"--altitude: {args.format} has one air density at every height; leave the option out")
    if args.altitude is not None and not (math.isfinite(args.altitude) and 0.0 <= args.altitude <= 11000.0):
        raise InputError(f"--altitude {args.altitude:g}: expected 0 to 11000 m")


def _read(args: argparse.Namespace) -> Imported:
    from sysid_node.sim.importing.gazebo.read import read_gazebo  # noqa: PLC0415  # SciPy and JAX take their time
    from sysid_node.sim.importing.jsbsim.read import read_jsbsim  # noqa: PLC0415
    from sysid_node.sim.importing.rosflight import read_rosflight  # noqa: PLC0415

    if args.format == "jsbsim":
        return read_jsbsim(args.model, args.airspeed, args.altitude)
    reader = read_gazebo if args.format == "gazebo" else read_rosflight
    return reader(Path(args.model), args.airspeed)


def _header(args: argparse.Namespace, notes: tuple[str, ...]) -> str:
    """The comment at the top: where the file is from, and what of the model it does not hold."""
    name = Path(args.model).name
    shown = "".join(letter if letter.isprintable() else "?" for letter in name)
    lines = [f"# {MARK} --format {args.format} from {shown}."]
    for note in notes:
        lines += textwrap.wrap(note, 110, initial_indent="# - ", subsequent_indent="#   ", break_long_words=False)
    return "\n".join(lines) + "\n"
