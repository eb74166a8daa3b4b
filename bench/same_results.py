"""Whether two versions of the package say the same of the same flights.

    python -m bench.same_results inputs FLIGHTS                     # make the flights, once
    python -m bench.same_results record FLIGHTS OUT [--tree DIR]    # run every case with the package in DIR
    python -m bench.same_results compare BEFORE AFTER               # hold two such records against each other

A case is one command of ``sysid`` on bundled, simulated or real flights. Every number in its JSON files and its tables
is compared to 1e-9 of its size, every word exactly. Real flights are left out, with a line that says so, where their
folder is absent (``SYSID_FLIGHTS`` names it).
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BAGS = ROOT / "bags"

#: Largest difference of two numbers that counts as none, as a share of the larger; and where both are this small.
RELATIVE, ABSOLUTE = 1e-9, 1e-13

_STEPS = "--manoeuvre 3211:repeat=2"

#: Simulated flights: name -> arguments of ``sysid simulate``.
SIMULATED = {
    "lag": f"--aircraft cdrw {_STEPS} --effect actuator_lag:time_constant=0.1 --seed 1",
    "lag_holdout": "--aircraft cdrw --manoeuvre multisine --effect actuator_lag:time_constant=0.1 --seed 2",
    "plain": f"--aircraft cdrw {_STEPS} --seed 5",
    "gusty_pair": f"--aircraft cdfp {_STEPS} --effect cg_shift:x=0.02 --effect imu_delay:delay=0.05 "
    "--turbulence light --seed 6",
    "gusty_pair_holdout": "--aircraft cdfp --manoeuvre multisine --effect cg_shift:x=0.02 "
    "--effect imu_delay:delay=0.05 --turbulence light --seed 7",
    "loss": f"--aircraft kestrel {_STEPS} --effect control_effectiveness_loss:aileron=0.5:onset=12 --seed 8 "
    "--surfaces measured",
}

#: Name -> arguments of ``sysid``; {bags} are the bundled flights, {in} those made by ``inputs``.
CASES = {
    **{
        f"replay_{name}": f"replay {{bags}}/{name} --aircraft {name[:4]}"
        for name in (
            "cdfp_multistep", "cdfp_random", "cdrw_failed_elevator", "cdrw_multistep", "cdrw_near_stall",
            "cdrw_random", "cdrw_slow", "cdrw_turbulence",
        )
    },
    "replay_instruments": "replay {bags}/cdrw_turbulence --aircraft cdrw --set method=iv_rft",
    "replay_plain": "replay {in}/plain --aircraft cdrw",
    "replay_loss": "replay {in}/loss --aircraft kestrel",
    "replay_no_vanes": "replay {in}/no_vanes_bag --aircraft cdrw",
    "replay_hfb320": "replay {in}/hfb320_bag --aircraft {in}/hfb320.yaml --set settle_time=0",
    "replay_thor": "replay {in}/thor_bag --aircraft {in}/thor.yaml",
    "replay_twin_otter": "replay {in}/twin_otter_bag --aircraft {in}/twin_otter.yaml --set settle_time=0",
    **{
        f"identify_{method}": f"identify {{bags}}/cdrw_multistep --aircraft cdrw --method {method} "
        "--holdout {bags}/cdrw_random"
        for method in (
            "equation_error", "frequency_equation_error", "recursive_least_squares", "error_filtering",
            "constrained_least_squares", "output_error",
        )
    },
    "identify_gusts": "identify {bags}/cdrw_turbulence --aircraft cdrw --method filter_error",
    "identify_stepwise": "identify {bags}/cdfp_multistep --aircraft cdfp --method equation_error --set stepwise=true "
    "--set correct_sensors=true",
    "identify_hfb320": "identify {in}/hfb320_bag --aircraft {in}/hfb320.yaml --method output_error --set segment=0",
    "identify_twin_otter": "identify {in}/twin_otter_bag --aircraft {in}/twin_otter.yaml --method equation_error",
    "gap_lag": "gap {in}/lag --holdout {in}/lag_holdout --aircraft cdrw",
    "gap_plain": "gap {in}/plain --aircraft cdrw",
    "gap_gusty_pair": "gap {in}/gusty_pair --holdout {in}/gusty_pair_holdout --aircraft cdfp",
    "gap_loss": "gap {in}/loss --aircraft kestrel",
    "gap_no_vanes": "gap {in}/no_vanes.csv --aircraft cdrw",
    "gap_near_stall": "gap {bags}/cdrw_near_stall --aircraft cdrw",
    "gap_failed_elevator": "gap {bags}/cdrw_failed_elevator --aircraft cdrw",
    "gap_hfb320": "gap {in}/hfb320.csv --holdout {in}/hfb320_held.csv --aircraft {in}/hfb320.yaml",
    "gap_thor": "gap {in}/thor.csv --holdout {in}/thor_held.csv --aircraft {in}/thor.yaml",
    "gap_twin_otter": "gap {in}/twin_otter.csv --aircraft {in}/twin_otter.yaml",
}  # fmt: skip


def make_inputs(folder: Path) -> None:
    """Simulated flights, one of them without vanes, and parts of real ones with their aircraft files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, arguments in SIMULATED.items():
        if not (folder / name).exists():
            sysid(["simulate", *shlex.split(arguments), "--out", str(folder / name), "--quiet"], ROOT)
    _without_vanes(folder / "lag", folder / "no_vanes.csv")
    bag = folder / "no_vanes_bag"
    if not bag.exists():
        log = str(folder / "no_vanes.csv")
        sysid(["convert", log, "--aircraft", "cdrw", "--out", str(bag), "--quiet"], ROOT)
    flights = Path(os.environ.get("SYSID_FLIGHTS", ROOT.parent / "shared" / "flights"))
    if not flights.is_dir():
        print(f"real flights not found at {flights}: their cases are left out")
        return
    _real(flights, folder)


def _without_vanes(bag: Path, log: Path) -> None:
    """A simulated flight as a log without flow angles."""
    import numpy as np  # noqa: PLC0415

    from sysid_node.aircraft.load import load_aircraft  # noqa: PLC0415
    from sysid_node.flight.csv import write_csv  # noqa: PLC0415
    from sysid_node.flight.logs.opening import load_flight_record  # noqa: PLC0415

    record = load_flight_record(bag, load_aircraft("cdrw"))
    for name in ("alpha", "beta"):
        record.columns[name] = np.full(len(record), np.nan)
    write_csv(log, record)


def _real(flights: Path, folder: Path) -> None:
    """The records that ``gap_real_flights.py`` diagnoses, and what it believes of their aircraft."""
    from bench.gap import real_flights as real  # noqa: PLC0415
    from sysid_node.aircraft.dump import dump_aircraft  # noqa: PLC0415
    from sysid_node.flight.csv import read_csv, write_csv  # noqa: PLC0415

    for name in ("hfb320", "thor", "twin_otter"):
        flight = real.FLIGHTS[name]
        record = read_csv(flights / flight.file)
        fitted = real.part(record, flight, flight.fitted)
        belief = real.believed(flight.aircraft(flights), flight, fitted)
        (folder / f"{name}.yaml").write_text(dump_aircraft(belief), encoding="utf-8")
        write_csv(folder / f"{name}.csv", fitted)
        if flight.held[1] > flight.held[0]:
            write_csv(folder / f"{name}_held.csv", real.part(record, flight, flight.held))
        shutil.rmtree(folder / f"{name}_bag", ignore_errors=True)
        log, believed, bag = str(flights / flight.file), str(folder / f"{name}.yaml"), str(folder / f"{name}_bag")
        sysid(["convert", log, "--aircraft", believed, "--out", bag, "--quiet"], ROOT)


def sysid(words: list[str], tree: Path) -> None:
    """One command by the package in a tree. Raises RuntimeError with the command's last line where it fails."""
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    done = subprocess.run(
        [sys.executable, "-m", "sysid_node.cli", *words],
        check=False, capture_output=True, text=True, env=environment, cwd=tree,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"sysid {' '.join(words)}: {done.stderr.strip()[-600:]}")


def record(inputs: Path, out: Path, tree: Path, only: str, jobs: int) -> None:
    """Runs the cases, so many at a time, and keeps what they wrote."""
    out.mkdir(parents=True, exist_ok=True)

    def work(name: str) -> str:
        words = shlex.split(CASES[name].format(**{"in": inputs.resolve(), "bags": BAGS}))
        if any(word.startswith(str(inputs.resolve())) and not Path(word).exists() for word in words):
            return f"{name}: left out, its flight is absent"
        begin, place = time.perf_counter(), out.resolve() / name
        shutil.rmtree(place, ignore_errors=True)
        try:
            sysid([*words, "--out", str(place), "--quiet"], tree.resolve())
        except RuntimeError as error:
            place.mkdir(parents=True, exist_ok=True)
            (place / "refused.json").write_text(json.dumps(str(error).rpartition("sysid ")[2]), encoding="utf-8")
        for path in (*place.glob("*.html"), place / "estimates"):
            shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)
        return f"{name}: {time.perf_counter() - begin:.1f} s"

    names = [name for name in CASES if any(part in name for part in only.split(","))]
    with ThreadPoolExecutor(jobs) as pool:
        for line in pool.map(work, names):
            print(line, flush=True)


def compare(before: Path, after: Path) -> bool:
    """Prints a line a case; whether all that both hold is the same."""
    same, names = True, sorted({p.name for p in before.iterdir()} & {p.name for p in after.iterdir()})
    count, worst_of_all = 0, 0.0
    for name in names:
        worst, words = 0.0, []
        files = sorted({p.name for p in (*(before / name).iterdir(), *(after / name).iterdir())})
        for file in files:
            if not ((before / name / file).exists() and (after / name / file).exists()):
                words.append(f"{file} is only in one")
                continue
            one, other = (dict(_leaves(folder / name / file)) for folder in (before, after))
            words += [f"{file} {key} is only in one" for key in sorted(one.keys() ^ other.keys())]
            for key in one.keys() & other.keys():
                count += 1
                difference = _difference(one[key], other[key])
                if difference is None:
                    words.append(f"{file} {key}: {one[key]!r}, then {other[key]!r}")
                else:
                    worst = max(worst, difference)
        good = not words and worst <= RELATIVE
        same, worst_of_all = same and good, max(worst, worst_of_all)
        print(f"{'same' if good else 'DIFFERS':8} {name:40} largest relative difference {worst:.1e}")
        for line in words[:6]:
            print(f"         {line[:200]}")
    only = sorted({p.name for p in before.iterdir()} ^ {p.name for p in after.iterdir()})
    if only:
        print(f"not compared, for only one holds them: {', '.join(only)}")
    print(f"{len(names)} cases, {count} values, largest relative difference {worst_of_all:.1e}: "
          f"{'the same' if same else 'NOT the same'}")  # fmt: skip
    return same


def _leaves(path: Path) -> Iterator[tuple[str, object]]:
    """Every value of a file under a key of its own; text files line by line."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        yield from _walk("", json.loads(text))
    elif path.suffix == ".csv":
        for i, row in enumerate(csv.reader(text.splitlines())):
            yield from ((f"{i}:{k}", _number(cell)) for k, cell in enumerate(row))
    else:
        for i, line in enumerate(text.splitlines()):
            yield from ((f"{i}:{k}", _number(word)) for k, word in enumerate(line.replace("=", " ").split()))


def _walk(key: str, value: object) -> Iterator[tuple[str, object]]:
    if isinstance(value, dict):
        for name, part in value.items():
            yield from _walk(f"{key}.{name}", part)
    elif isinstance(value, list):
        for i, part in enumerate(value):
            yield from _walk(f"{key}[{i}]", part)
    else:
        yield key, value


def _number(cell: str) -> object:
    try:
        return float(cell.rstrip(",}"))
    except ValueError:
        return cell


def _missing(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)


def _difference(one: object, other: object) -> float | None:
    """Relative difference of two numbers; 0 for equal values; None for words that differ."""
    if one == other or (_missing(one) and _missing(other)):
        return 0.0
    if isinstance(one, bool) or not (isinstance(one, int | float) and isinstance(other, int | float)):
        return None
    if abs(one - other) <= ABSOLUTE:
        return 0.0
    return abs(one - other) / max(abs(one), abs(other))


def main() -> int:
    """One of the three steps."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    steps = parser.add_subparsers(dest="step", required=True)
    steps.add_parser("inputs").add_argument("flights", type=Path)
    recording = steps.add_parser("record")
    recording.add_argument("flights", type=Path)
    recording.add_argument("out", type=Path)
    recording.add_argument("--tree", type=Path, default=ROOT, help="checkout whose package runs (default: this)")
    recording.add_argument("--only", default="", help="parts of cases' names, with commas between")
    recording.add_argument("--jobs", type=int, default=2, help="cases at a time (default: 2)")
    comparing = steps.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    args = parser.parse_args()
    if args.step == "inputs":
        make_inputs(args.flights)
    elif args.step == "record":
        record(args.flights, args.out, args.tree, args.only, args.jobs)
    else:
        return 0 if compare(args.before, args.after) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
