"""Ctrl-C and SIGTERM at random times in every command: exit code, lines on stderr, and what is left behind.

A time is that of the processor, from when Python begins to import to what the whole command has taken before, so that
a busy computer meets the same places in the program. A command that is done before the signal arrives counts as such.
What is left behind is anything beside ``--out`` or in it but finished results, finished steps of a diagnosis and the
state of a fleet.

    python -m bench.robustness.signals [--times 20] [--seed 1] [--only replay,gap] [--page docs/results/signals.md]
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from bench.pages import publish, table
from bench.robustness.seeds import beginning
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams

ROOT = Path(__file__).resolve().parents[2]
BAG = ROOT / "bags" / "cdrw_multistep"
SHORT = 10.0  # s of the flight that the longer commands read
SOONEST = 0.1  # s of processor time: by then Python has begun with the program itself
PATIENCE = 120.0  # s by the clock until a command must have ended
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}


class Case(NamedTuple):
    """A command: ``{made}`` stands for a folder with what commands read, ``{out}`` for what this one writes."""

    words: Sequence[str]
    quiet: bool = True


_OUT = ("--out", "{out}")
_SHORT = ("{made}/short", "--aircraft", "cdrw")
_FLOWN = ("--aircraft", "cdrw", "--manoeuvre", "doublet", "--duration", "9")
CASES: Mapping[str, Case] = MappingProxyType(
    {
        "replay": Case(("replay", *_SHORT, *_OUT)),
        "identify": Case(("identify", *_SHORT, "--method", "equation_error", *_OUT)),
        "identify, output error": Case(("identify", *_SHORT, "--method", "output_error", *_OUT)),
        "simulate": Case(("simulate", *_FLOWN, *_OUT)),
        "excite": Case(("excite", *_FLOWN, *_OUT)),
        "gap": Case(("gap", *_SHORT, *_OUT)),
        "fleet": Case(("fleet", "{made}/fleet.csv", "--workers", "1", *_OUT)),
        "convert": Case(("convert", "{made}/log.csv", "--aircraft", "cdrw", *_OUT)),
        "check": Case(("check", str(BAG)), quiet=False),
        "view": Case(("view", "{made}/run", "--save", "{out}.rrd")),
        "report": Case(("report", "{made}/run")),
        "export": Case(("export", "cdrw", "--format", "jsbsim", *_OUT)),
        "import": Case(("import", "{made}/model.xml", "--format", "jsbsim", *_OUT)),
        "aircraft": Case(("aircraft", "cdrw", *_OUT)),
        "demo": Case(("demo", "{made}/short", "--rate", "10", *_OUT), quiet=False),
        "loop": Case(("loop", "--seconds", "5", *_OUT), quiet=False),
    }
)


def make(folder: Path) -> None:
    """What commands read: a short flight, a run, a CSV, a model, a catalogue."""
    write_streams(folder / "short", beginning(read_streams(BAG), SHORT))
    for words in (
        ["replay", str(BAG), "--aircraft", "cdrw", "--out", str(folder / "run"), "--quiet", "--set", "publish_rate=1"],
        ["export", "cdrw", "--format", "jsbsim", "--out", str(folder / "model.xml"), "--quiet"],
    ):
        subprocess.run([sys.executable, "-m", "sysid_node.cli", *words], check=True, cwd=ROOT)
    (folder / "fleet.csv").write_text(
        f"path,aircraft,tail\n{folder}/short,cdrw,7\n{folder}/short,cdrw,8\n", encoding="utf-8"
    )
    from sysid_node import load  # noqa: PLC0415  # a command of its own takes as long
    from sysid_node.flight.csv import write_csv  # noqa: PLC0415

    write_csv(folder / "log.csv", load(BAG, "cdrw").record)


def worked(process: int) -> float:
    """Processor time of a process so far, s (Linux); infinite where it has ended."""
    try:
        text = Path(f"/proc/{process}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    except OSError:
        return float("inf")
    ended = text[0] == "Z"
    return float("inf") if ended else (int(text[11]) + int(text[12])) / os.sysconf("SC_CLK_TCK")


def whole(case: Case, made: Path) -> float:
    """Processor time that a command takes undisturbed, s; the second of two runs, as the first may compile."""
    for _ in range(2):
        with tempfile.TemporaryDirectory() as name:
            with subprocess.Popen(command_of(case, Path(name, "out"), made), stdout=subprocess.DEVNULL) as process:
                took, now = 0.0, 0.0
                while now < float("inf"):
                    took, now = now, worked(process.pid)
                    time.sleep(0.01)
            if process.returncode:
                raise SystemExit(f"{' '.join(case.words)} ended with {process.returncode}")
    return took


def command_of(case: Case, out: Path, made: Path) -> list[str]:
    """The command that reads ``made`` and writes ``out``."""
    words = [word.replace("{out}", str(out)).replace("{made}", str(made)) for word in case.words]
    return [sys.executable, "-m", "sysid_node.cli", *words, *(["--quiet"] if case.quiet else [])]


def ended(case: Case, made: Path, number: signal.Signals, after: float) -> str:
    """How a command ended that was sent a signal after some processor time (s), in words; "as it should" if so."""
    with tempfile.TemporaryDirectory() as name:
        folder, inputs = Path(name, "work"), Path(name, "made")
        folder.mkdir()
        shutil.copytree(made, inputs)
        before = _content(inputs)
        command = command_of(case, folder / "out", inputs)
        with subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=ROOT
        ) as process:
            while worked(process.pid) < after:
                time.sleep(0.01)
            process.send_signal(number)
            try:
                _, said = process.communicate(timeout=PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                return f"did not end within {PATIENCE:g} s"
        if process.returncode == 0:
            return "was done"
        if process.returncode != CODES[number]:
            return f"exit {process.returncode}: {' '.join(said.split())[-80:]}"
        if len(said.splitlines()) != 1:
            return f"{len(said.splitlines())} lines"
        return _left(folder, inputs, before)


def _left(folder: Path, inputs: Path, before: Mapping[str, bytes]) -> str:
    """Whether a command left anything half-written, or changed what it read."""
    beside, out = {path.name for path in folder.iterdir()}, folder / "out"
    within = {path.name for path in out.iterdir()} if out.is_dir() else set()
    logs = {name for name in within if name.endswith(".log")}  # of the nodes of demo and loop
    if beside - {"out"} or within - logs - {"unfinished", "fleet.sqlite"} or (beside and not out.is_dir()):
        return f"left {sorted(beside | within)}"
    return "as it should" if _content(inputs) == before else "changed its input"


def _content(folder: Path) -> dict[str, bytes]:
    """All files by their path."""
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.rglob("*")) if f.is_file()}


def main() -> None:
    """Try all commands; print the table, or put it in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=20, help="of each signal")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default=";".join(CASES), help="commands, with semicolons between")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts what is in the background without it
    rng, rows = random.Random(args.seed), []
    with tempfile.TemporaryDirectory() as name:
        make(Path(name))
        for command in args.only.split(";"):
            case = CASES[command]
            seconds = whole(case, Path(name))
            for number in CODES:
                times = [rng.uniform(SOONEST, seconds) for _ in range(args.times)]
                found = Counter(ended(case, Path(name), number, after) for after in times)
                good, done = found.pop("as it should", 0), found.pop("was done", 0)
                other = "; ".join(f"{count} x {what}" for what, count in found.most_common()) or "-"
                rows.append([command, number.name, f"{seconds:.1f}", f"{good}", f"{done}", other])
                print(rows[-1], file=sys.stderr, flush=True)
    heads = ("command", "signal", "within s", "ended as it should", "was done before", "else")
    publish("bench/robustness/signals.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
