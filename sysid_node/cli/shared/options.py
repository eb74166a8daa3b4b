"""Options that several commands have in common, and what their texts mean."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from pathlib import Path

from sysid_node.errors import InputError
from sysid_node.flight.frames import BODY_FRAMES

LOG_HELP = "a flight, told by its content: bag (ROS 1 or 2), PX4 .ulg, ArduPilot .bin or .tlog, CSV"


def add_aircraft(parser: argparse.ArgumentParser) -> None:
    """``--aircraft``, which is required."""
    parser.add_argument("--aircraft", required=True, metavar="FILE|NAME", help="aircraft file, or name as in cdrw")


def add_out(parser: argparse.ArgumentParser, more: str = "") -> None:
    """``--out``, which is required; ``more`` ends its help."""
    parser.add_argument("--out", required=True, metavar="DIR", type=Path, help=f"folder for the results{more}")
    add_force(parser)


def add_force(parser: argparse.ArgumentParser) -> None:
    """``--force``."""
    parser.add_argument("--force", action="store_true", help="write into --out although it holds something else")


def add_holdout(parser: argparse.ArgumentParser) -> None:
    """``--holdout``, which may be given several times."""
    add = parser.add_argument
    add("--holdout", action="append", default=[], metavar="BAG", type=Path, help="a flight to check on, not to fit")


def add_settings(parser: argparse.ArgumentParser, meaning: str, lines_of: str) -> None:
    """``--set`` and ``--frequencies``; their helps say what a setting is, and of what the frequencies are lines."""
    parser.add_argument("--frequencies", metavar="START:STEP:STOP", help=f"lines of {lines_of}, Hz")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help=meaning)


def add_reading(parser: argparse.ArgumentParser) -> None:
    """How a bag is read, and ``--quiet``."""
    add_topics(parser)
    add_quiet(parser)


def add_topics(parser: argparse.ArgumentParser) -> None:
    """How a bag is read: ``--topic`` and ``--body-frame``."""
    add = parser.add_argument
    add("--topic", action="append", default=[], metavar="OURS:=THEIRS", help="a topic's name in the bag")
    add("--body-frame", choices=BODY_FRAMES, default="flu", help="axes of the IMU messages (default: flu)")


def add_view(parser: argparse.ArgumentParser) -> None:
    """``--view``, with or without a file."""
    meaning = "show the flight in the viewer Rerun meanwhile, or write it into a file"
    parser.add_argument("--view", metavar="FILE.rrd", type=Path, nargs="?", const=Path("-"), help=meaning)


def add_quiet(parser: argparse.ArgumentParser) -> None:
    """``--quiet``."""
    parser.add_argument("--quiet", action="store_true", help="print nothing")


def inputs_of(files: Iterable[str | Path], aircraft: str | None) -> list[Path]:
    """What a command reads: files and folders, and the aircraft's file where no name is given."""
    found = [Path(file) for file in files]
    return [*found, Path(aircraft)] if aircraft and os.path.isfile(aircraft) else found  # noqa: PTH113  # any length


def refuse_twice(flights: Iterable[Path]) -> None:
    """Raise InputError where a flight is given twice: again it tells nothing new, and checks nothing."""
    seen: set[Path] = set()
    for flight in flights:
        if (place := flight.resolve()) in seen:
            raise InputError(f"{flight}: this flight is given twice; leave it out once")
        seen.add(place)


def settings_of(texts: Iterable[str], frequencies: str | None, example: str) -> dict[str, object]:
    """The settings of ``--set key=value`` and ``--frequencies``, as texts. Raises InputError with an example."""
    values: dict[str, object] = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator:
            raise InputError(f"--set {text!r}: expected KEY=VALUE, e.g. {example}")
        if key.strip() in values:
            raise InputError(f"--set {text!r}: {key.strip()} is given twice; keep one")
        values[key.strip()] = value.strip()
    if frequencies is not None:
        if "frequencies" in values:
            raise InputError("--frequencies and --set frequencies: both are given; keep one")
        values["frequencies"] = frequencies
    return values
