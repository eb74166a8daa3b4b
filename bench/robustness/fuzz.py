"""Damaged input for every reader and command: none may crash, hang, print a traceback or end with other than 0 or 2.

Each case is a process of its own, with a limit of time and of memory. What breaks is kept as a case, with its input and
its command; at the end stands a table of what was tried and what broke.

    python -m bench.robustness.fuzz [--seconds 600] [--seed 1] [--logs ../shared/logs] [--out out/fuzz]
    python -m bench.robustness.fuzz --again out/fuzz/0001
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import random
import re
import resource
import shutil
import signal
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from bench.robustness.seeds import Seeds
from bench.robustness.targets import Targets
from sysid_node.cli.main import main as sysid

LONGEST, MEMORY = 60.0, 4 * 2**30  # s of processor time, and bytes, of one case
WAITED = 10.0  # times as long by the clock is a case waited for: other programs may want the processors
SLOW_LONGEST, SLOW_MEMORY = 600.0, 16 * 2**30  # the same of one that compiles; JAX reserves much that it never uses
WITHOUT_QUIET = ("check",)
PRELOADED = ("sysid_node.api.identification", "sysid_node.api.fleet_run", "sysid_node.view.recording", "rerun", "jax")
KEPT = 3  # cases of each kind of break
SLOW_EVERY = 40  # rounds between cases of the slow kinds


class Outcome(NamedTuple):
    """How a command ended: its exit code (negative: the signal; None: not at all) and what it wrote to stderr."""

    code: int | None
    said: str

    @property
    def broke(self) -> str:
        """What is wrong, in short; empty where nothing is."""
        lines = [line for line in self.said.splitlines() if ": warning: " not in line]
        if self.code is None:
            return f"not done after {LONGEST:g} s"
        if self.code not in (0, 2):
            last = re.sub(r"/\S+|\d+", "N", lines[-1] if lines else "nothing said")
            return f"exit {self.code}: {last[:120]}"
        if "Traceback" in self.said:
            return "a traceback"
        if self.code == 2 and len(lines) != 1:
            return f"exit 2 with {len(lines)} lines"
        return "exit 0 with lines on stderr" if self.code == 0 and lines else ""


def outcome_of(words: Sequence[str], place: Path, longest: float = LONGEST, memory: int = MEMORY) -> Outcome:
    """How a command ends in a process of its own, which works in ``place`` for at most ``longest`` s, with so much."""
    process = os.fork()
    if not process:
        _work(words, place, memory)
    end = time.monotonic() + WAITED * longest
    while time.monotonic() < end and _worked(process) < longest:
        done, status = os.waitpid(process, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(status)
            return Outcome(code, (place / "stderr").read_text(errors="replace"))
        time.sleep(0.005)
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return Outcome(None, (place / "stderr").read_text(errors="replace"))


def _worked(process: int) -> float:
    """Processor time of a process so far, s (Linux)."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _work(words: Sequence[str], place: Path, memory: int) -> None:
    """The command, in the child."""
    code = 1
    try:
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        for name, stream in (("stdout", 1), ("stderr", 2)):
            os.dup2(os.open(place / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
        code = sysid(list(words) if words[0] in WITHOUT_QUIET else [*words, "--quiet"])
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def preload() -> None:
    """Import what commands import when they need it, so that each case need not; nothing that starts threads."""
    for name in PRELOADED:
        importlib.import_module(name)


def hunt(
    seeds: Seeds, seconds: float, rounds: int, seed: int, out: Path
) -> tuple[Counter[str], Counter[tuple[str, str]]]:
    """Cases tried by kind, and breaks by kind and what was wrong; the first of each are kept under ``out``.

    A round has one case of each quick kind, and one round in ``SLOW_EVERY``, beginning with the last of so many, of
    each slow one; the hunt ends after ``rounds`` or ``seconds``.
    """
    rng = random.Random(seed)
    targets = Targets(seeds)
    quick, slow = targets.quick(), targets.slow()
    tried: Counter[str] = Counter()
    broke: Counter[tuple[str, str]] = Counter()
    end = time.monotonic() + seconds
    for number in range(1, rounds + 1):
        if time.monotonic() > end:
            break
        for kind, case in {**quick, **(slow if number % SLOW_EVERY == 0 else {})}.items():
            place = Path(tempfile.mkdtemp(prefix="sysid-fuzz-"))
            words = case(place, rng)
            limits = (SLOW_LONGEST, SLOW_MEMORY) if kind in slow else (LONGEST, MEMORY)
            found = outcome_of(words, place, *limits)
            tried[kind] += 1
            if found.broke:
                broke[kind, found.broke] += 1
                if broke[kind, found.broke] <= KEPT:
                    _keep(place, out / f"{sum(broke.values()):04d}", words, found)
            shutil.rmtree(place, ignore_errors=True)
    return tried, broke


def _keep(place: Path, folder: Path, words: Sequence[str], found: Outcome) -> None:
    """Keep the input; the words name it by ``{place}``."""
    shutil.copytree(place, folder, dirs_exist_ok=True)
    named = [word.replace(str(place), "{place}") for word in words]
    case = {"words": named, "broke": found.broke, "code": found.code}
    (folder / "case.json").write_text(json.dumps(case, indent=2) + "\n")


def again(folder: Path) -> Outcome:
    """How a kept case ends today."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name, "case")
        shutil.copytree(folder, place)
        for made in ("out", "converted", "model", "o", "o.yaml"):
            shutil.rmtree(place / made, ignore_errors=True)
        words = json.loads((place / "case.json").read_text())["words"]
        return outcome_of([word.replace("{place}", str(place)) for word in words], place)


def main() -> None:
    """Hunt, keep, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rounds", type=int, default=10**9, help="at most; each has a case of every kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=Path, help="a folder of sound logs to damage, too")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--again", type=Path, help="run a kept case again")
    args = parser.parse_args()
    if args.again:
        print(again(args.again))
        return
    preload()
    with tempfile.TemporaryDirectory(prefix="sysid-seeds-") as folder:
        tried, broke = hunt(Seeds.made(Path(folder), args.logs), args.seconds, args.rounds, args.seed, args.out)
    print("| input | tried | broke |\n|---|---:|---:|")
    for kind, count in tried.items():
        print(f"| {kind} | {count} | {sum(n for (of, _), n in broke.items() if of == kind)} |")
    print(f"| all | {sum(tried.values())} | {sum(broke.values())} |")
    for (kind, what), count in broke.most_common():
        print(f"{count:5d} x {kind}: {what}")


if __name__ == "__main__":
    main()
