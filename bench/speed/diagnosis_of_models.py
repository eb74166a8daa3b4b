"""What ``sysid gap`` costs where the simulator models more: with effects and tables in the file, or by its own flights.

    python -m bench.speed.diagnosis_of_models [--repeat 3] [--page docs/results/cost.md]

One flight of 60 s at 100 Hz (cdrw, light turbulence, an actuator's lag) is held against three files: the file as it is,
the same with servos and two tables, and a surrogate that is identified from two simulated flights of 60 s. JSBSim's
c172p is imported, with a hundred tables, and held against a flight of its own; so is the same file without its tables.
So is JSBSim's 737 against 200 s of its flight at 25 Hz. Programs are kept. Run it on an idle
machine; the ratio of two files tells of any.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from bench.pages import publish, table
from bench.speed.diagnosis import Cost, diagnosed, flown
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import LookupTable, UncertainValue

_AIRCRAFT = "cdrw"
_MODEL, _TRANSPORT = "c172p", "737"
_ALONE, _PLAIN_IMPORT = "the file alone", f"{_MODEL} as imported, without its tables"
_HEAVY = f"{_TRANSPORT} as imported, 200 s at 25 Hz"
_SERVO = UncertainValue(0.03, 0.006)  # s
#: What is flown in the user's simulator, which has no noise and no lag.
_PLAIN = ("--noise", "0", "--rate", "100", "--duration", "60")
_SIMULATED = (
    (*_PLAIN, *(word for s in ("elevator", "aileron", "rudder") for word in ("--manoeuvre", f"3211:{s}:repeat=6"))),
    (*_PLAIN, "--manoeuvre", "multisine"),
)
#: What the transport flies: 3-2-1-1 after 3-2-1-1 of 7 s, twelve on each surface, so that nothing is left out.
_LONG = (
    *("--effect", "actuator_lag:time_constant=0.3", "--turbulence", "light", "--rate", "25", "--duration", "200"),
    *(word for s in ("elevator", "aileron", "rudder") for word in ("--manoeuvre", f"3211:{s}:repeat=12:width=1")),
)


def main() -> None:
    """Print the table, or put it in a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3, help="times that each is run (default: 3)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        text = _measured(Path(folder), args.repeat)
    publish("bench/speed/diagnosis_of_models.py", text, args.page)


def _measured(folder: Path, repeat: int) -> str:
    real = flown(folder / "real", 3)
    simulated = [flown(folder / f"simulated_{k}", k, flight) for k, flight in enumerate(_SIMULATED)]
    imported, seconds = _imported(folder, _MODEL)
    plain = folder / "plain.yaml"
    plain.write_text(dump_aircraft(replace(load_aircraft(str(imported)), tables=())), encoding="utf-8")
    heavy, _ = _imported(folder, _TRANSPORT)
    flights = {path: flown(folder / f"of_{path.stem}", 3, aircraft=str(path)) for path in (imported, plain)}
    kinds: Mapping[str, tuple[Path, list[str], str]] = {
        _ALONE: (real, ["--aircraft", _AIRCRAFT], _ALONE),
        "with servos and two tables in the file": (
            real,
            ["--aircraft", str(_detailed(folder / "detailed.yaml"))],
            _ALONE,
        ),
        "by two simulated flights of 60 s": (
            real,
            ["--aircraft", _AIRCRAFT, "--simulated", *map(str, simulated)],
            _ALONE,
        ),
        _PLAIN_IMPORT: (flights[plain], ["--aircraft", str(plain)], _PLAIN_IMPORT),
        f"{_MODEL} as imported": (flights[imported], ["--aircraft", str(imported)], _PLAIN_IMPORT),
        _HEAVY: (flown(folder / "long", 3, _LONG, str(heavy)), ["--aircraft", str(heavy)], _HEAVY),
    }
    costs = {name: _repeated(bag, words, folder, repeat) for name, (bag, words, _) in kinds.items()}
    bases = {name: statistics.median(cost.processor for cost in costs[base]) for name, (_, _, base) in kinds.items()}
    rows = [_row(name, each, bases[name]) for name, each in costs.items()]
    said = f"Medians of {repeat}. `sysid import {_MODEL}` takes {seconds:.1f} s by the clock."
    return f"{table(('', 'by the clock, s', 'processor time, s', 'of the file without tables'), rows)}\n\n{said}"


def _imported(folder: Path, model: str) -> tuple[Path, float]:
    """The file of an imported model, and how long the import took, s."""
    imported = folder / f"{model}.yaml"
    words = [sys.executable, "-m", "sysid_node.cli", "import", model, "--format", "jsbsim", "--out", str(imported)]
    begin = time.monotonic()
    subprocess.run(words, check=True, capture_output=True)
    return imported, time.monotonic() - begin


def _detailed(path: Path) -> Path:
    """The aircraft file with servos and two tables."""
    aircraft = load_aircraft(_AIRCRAFT)
    alpha = (-0.2, -0.1, 0.0, 0.1, 0.2, 0.3)
    tables = (
        LookupTable("CL", ("alpha",), (alpha,), (0.0, 0.0, 0.0, 0.0, -0.005, -0.03)),
        LookupTable("Cm", ("alpha", "de"), ((-0.2, 0.3), (-0.3, 0.0, 0.3)), ((0.0, 0.0, 0.0), (0.01, 0.0, -0.01))),
    )
    effects = {"actuator_lag": dict.fromkeys(aircraft.controls, _SERVO)}
    path.write_text(dump_aircraft(replace(aircraft, effects=effects, tables=tables)), encoding="utf-8")
    return path


def _repeated(real: Path, words: list[str], folder: Path, repeat: int) -> list[Cost]:
    """The costs with programs kept: the first run makes them, and does not count."""
    return [diagnosed([real], folder, "cache", words) for _ in range(repeat + 1)][1:]


def _row(name: str, costs: list[Cost], base: float) -> list[str]:
    clock, processor = (statistics.median(getattr(cost, key) for cost in costs) for key in ("clock", "processor"))
    return [name, f"{clock:.1f}", f"{processor:.1f}", f"{processor / base:.2f}"]


if __name__ == "__main__":
    main()
