"""``sysid export``: an estimate as another simulator's model."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.cli.shared import options
from sysid_node.errors import InputError
from sysid_node.report.files.outputs.output_file import check_file, write_file
from sysid_node.report.files.outputs.output_folder import AIRCRAFT, WRITTEN

if TYPE_CHECKING:
    from sysid_node.sim.export.exported import Exported

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

#: What stands near the beginning of every file that this command writes, by which a later run knows it.
MARK = "sysid export"

FORMATS = ("jsbsim", "gazebo", "rosflight")


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("export", help="write an estimate as another simulator's model", description=__doc__)
    estimate = "summary.json of a run, its folder, or an aircraft (file or name)"
    parser.add_argument("estimate", metavar="ESTIMATE", help=estimate)
    parser.add_argument("--aircraft", help="file or name (default: the one that the run keeps beside its estimate)")
    parser.add_argument("--format", choices=FORMATS, required=True, help="whose model")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the file to write")
    options.add_force(parser)
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME:KEY=VALUE",
        help="an effect to include, where the format can express it",
    )
    parser.add_argument(
        "--model",
        dest="own_model",
        metavar="FILE",
        type=Path,
        help="gazebo, rosflight: your own model, into a copy of which the difference is written",
    )
    parser.add_argument("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Reads the estimate and writes the model."""
    inputs = options.inputs_of(
        [args.estimate, *([str(args.own_model)] if args.own_model is not None else [])], args.aircraft
    )
    check_file(args.out, inputs, MARK, force=args.force)
    summary = _summary(args.estimate)
    if args.aircraft and not summary:
        raise InputError(f"--aircraft {args.aircraft}: {args.estimate} is an aircraft itself; give one of the two")
    aircraft = load_aircraft(args.aircraft or (_kept_beside(args.estimate, summary) if summary else args.estimate))
    left: list[str] = []
    if summary:
        if args.aircraft:
            _refuse_another(args.estimate, summary, args.aircraft, aircraft)
        aircraft, left = with_estimates(aircraft, summary["derivatives"])
    exported = _into(args, aircraft) if args.own_model is not None else _write(args.format, aircraft, args.effect)
    write_file(args.out, exported.text)
    if not args.quiet:
        kept = f"; not valid, kept as in the aircraft file: {', '.join(left)}" if left else ""
        lost = f"; what {args.format} does not hold:" if exported.left_out else ""
        print(f"{args.out}: {aircraft.name} for {args.format}{kept}{lost}")
        for line in exported.left_out:
            print(f"- {line}")


def _kept_beside(estimate: str, summary: Mapping[str, Any]) -> Path:
    """The aircraft file that a run keeps beside its summary. Raises InputError where there is none.

    A name alone is not enough: another aircraft of that name may come with the package.
    """
    kept = _kept(estimate, summary)
    if kept is not None:
        return kept
    raise InputError(
        f"{Path(estimate)}: keeps no aircraft file, and {summary['aircraft']!r:.60} may name several; "
        "give the one that was used as --aircraft"
    )


def _kept(estimate: str, summary: Mapping[str, Any]) -> Path | None:
    """The aircraft file that a run keeps beside its summary; None where there is none."""
    path = Path(estimate)
    kept = (path if path.is_dir() else path.parent) / AIRCRAFT
    written = summary.get(WRITTEN)
    files = written.get("files") if isinstance(written, dict) else None
    return kept if isinstance(files, list) and AIRCRAFT in files and kept.is_file() else None


def _refuse_another(estimate: str, summary: Mapping[str, Any], given: str, aircraft: Aircraft) -> None:
    """Raise InputError where the aircraft is not that of the estimate: coefficients belong to an area and a chord."""
    if summary["aircraft"] != aircraft.name:
        raise InputError(
            f"--aircraft {given}: is {aircraft.name!r:.60}, but {estimate} was estimated with "
            f"{summary['aircraft']!r:.60}; give that aircraft's file"
        )
    kept = _kept(estimate, summary)
    used = aircraft.geometry if kept is None else load_aircraft(kept).geometry
    for name in ("S", "b", "cbar"):
        ours, theirs = getattr(aircraft.geometry, name), getattr(used, name)
        if not math.isclose(ours, theirs, rel_tol=1e-6):
            raise InputError(
                f"--aircraft {given}: geometry.{name} is {ours:g}, but {estimate} was estimated with {theirs:g}, to "
                "which its coefficients belong; give the file that was used"
            )


def with_estimates(aircraft: Aircraft, estimates: Mapping[str, Mapping[str, Any]]) -> tuple[Aircraft, list[str]]:
    """The aircraft with the valid estimates for its derivatives, and the names of those that are not valid."""
    derivatives, left = dict(aircraft.derivatives), []
    for name, estimate in estimates.items():
        if name not in derivatives:
            raise InputError(
                f"estimate of {name!r}: the aircraft {aircraft.name!r} has no such derivative; is it its file?"
            )
        value, error = (_number(name, key, estimate.get(key)) for key in ("value", "standard_error"))
        if estimate.get("valid") is True and value is not None:
            derivatives[name] = Derivative(value, error or None)
        else:
            left.append(name)
    return replace(aircraft, derivatives=derivatives), left


#: Beyond every estimate, in any unit.
_LARGEST = 1e100


def _number(name: str, key: str, value: object) -> float | None:
    """A number of an estimate; None where it is null. Raises InputError where it is neither, or not finite."""
    if value is None:
        return None
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) < _LARGEST:
        raise InputError(f"estimate of {name!r}: {key} is {value!r:.60}, expected a finite number or null")
    return float(value)


def _summary(estimate: str) -> dict[str, Any] | None:
    """The run's summary; None where the estimate is an aircraft. Raises InputError where it is neither."""
    path = Path(estimate)
    path = path / "summary.json" if path.is_dir() else path
    if path.suffix != ".json":
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(found["aircraft"], str) and all(isinstance(d, dict) for d in found["derivatives"].values()):
            return dict(found)
    except FileNotFoundError:
        raise InputError(f"{path}: not found; give the folder of a run, its summary.json, or an aircraft") from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    raise InputError(f"{path}: not the summary.json of a run (it needs aircraft and derivatives)")


def _into(args: argparse.Namespace, aircraft: Aircraft) -> Exported:
    """A copy of the user's own model with what the aircraft has other than it. Raises InputError."""
    from sysid_node.sim.correcting.gazebo_model import corrected_sdf  # noqa: PLC0415  # JAX takes its time
    from sysid_node.sim.correcting.rosflight_model import corrected_parameters  # noqa: PLC0415

    if args.format == "jsbsim":
        raise InputError("--model: a JSBSim model is corrected by sysid gap --simulator jsbsim:FILE; leave it out here")
    if args.effect:
        raise InputError("--model: give effects in the aircraft file, and not as --effect")
    write = {"gazebo": corrected_sdf, "rosflight": corrected_parameters}[args.format]
    return write(args.own_model, aircraft)


def _write(form: str, aircraft: Aircraft, specs: list[str]) -> Exported:
    """The model. Raises InputError for an effect asked for that its format cannot hold."""
    from sysid_node.sim.export.gazebo.model import gazebo_model  # noqa: PLC0415  # JAX takes its time
    from sysid_node.sim.export.jsbsim import export_jsbsim  # noqa: PLC0415
    from sysid_node.sim.export.rosflight import rosflight_parameters  # noqa: PLC0415
    from sysid_node.sim.model import parameters  # noqa: PLC0415
    from sysid_node.sim.simulator import Simulator  # noqa: PLC0415

    effects = Simulator(aircraft).effects(specs) if specs or aircraft.effect_values() else {}
    write = {"jsbsim": export_jsbsim, "gazebo": gazebo_model, "rosflight": rosflight_parameters}[form]
    exported = write(aircraft, effects)
    for name in parameters.parse(specs):
        why = next((line for line in exported.left_out if line.startswith(f"{name}:")), None)
        if why is not None and name not in exported.held:
            raise InputError(f"effect {name!r} cannot be exported to {form}: {why.partition(': ')[2]}")
    return exported
