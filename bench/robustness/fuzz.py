"""Damaged input for every reader and command: none may crash, hang, print a traceback or end with other than 0 or 2.

Each case is a process of its own, with a limit of time and of memory. The next case is always of the kind that has
taken the least processor time so far, so that all kinds have the same share of it. What breaks is kept as a case, with
its input and its command; at the end stands a table of what was tried and what broke.

    python -m bench.robustness.fuzz [--seconds 600] [--cases 10000] [--seed 1] [--logs LOGS] [--out out/fuzz]
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
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from bench.pages import publish, table
from bench.robustness.seeds import Seeds
from bench.robustness.targets import Targets
from sysid_node.cli.main import main as sysid

LONGEST, MEMORY = 60.0, 4 * 2**30  # s of processor time, and bytes, of one case
WAITED = 10.0  # times as long by the clock is a case waited for: other programs may want the processors
SLOW_LONGEST, SLOW_MEMORY = 600.0, 16 * 2**30  # the same of one that compiles; JAX reserves much that it never uses
WITHOUT_QUIET = ("check",)
PRELOADED = ("sysid_node.api.identification", "sysid_node.api.fleet_run", "sysid_node.view.recording", "rerun", "jax")
KEPT = 3  # cases of each kind of break
_WHO = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


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


class Tally:
    """What was tried: cases and their processor time (s) by kind, breaks by kind and what was wrong."""

    def __init__(self, kinds: Iterable[str]) -> None:
        self.seconds = dict.fromkeys(kinds, 0.0)
        self.tried: Counter[str] = Counter()
        self.broke: Counter[tuple[str, str]] = Counter()

    def next(self) -> str:
        """The kind that has taken the least time so far."""
        return min(self.seconds, key=lambda kind: (self.seconds[kind], self.tried[kind]))

    def text(self) -> str:
        """The table, and what broke."""
        rows = [
            [kind, f"{self.tried[kind]}", f"{sum(n for (of, _), n in self.broke.items() if of == kind)}", f"{used:.0f}"]
            for kind, used in self.seconds.items()
        ]
        sums = (self.tried, self.broke, self.seconds)
        rows.append(["all", f"{sums[0].total()}", f"{sums[1].total()}", f"{sum(sums[2].values()):.0f}"])
        lines = [f"- {count} x {kind}: {what}" for (kind, what), count in self.broke.most_common()]
        return "\n".join(
            [table(("input", "tried", "broke", "processor time, s"), rows), *([""] if lines else []), *lines]
        )


def hunt(seeds: Seeds, seconds: float, cases: int, seed: int, out: Path, fast: bool = False) -> Tally:
    """What so many ``cases`` found, or those that were done in so many seconds; breaks are kept under ``out``.

    Each kind draws its cases from numbers of its own. ``fast`` leaves out the kinds that compile or fit.
    """
    targets = Targets(seeds)
    quick, slow = targets.quick(), {} if fast else targets.slow()
    kinds = {**quick, **slow}
    rngs = {kind: random.Random(f"{seed} {kind}") for kind in kinds}
    tally, end = Tally(kinds), time.monotonic() + seconds
    while tally.tried.total() < cases and time.monotonic() < end:
        kind, before = tally.next(), _spent()
        place = Path(tempfile.mkdtemp(prefix="sysid-fuzz-"))
        words = kinds[kind](place, rngs[kind])
        found = outcome_of(words, place, *((SLOW_LONGEST, SLOW_MEMORY) if kind in slow else (LONGEST, MEMORY)))
        tally.tried[kind] += 1
        if found.broke:
            tally.broke[kind, found.broke] += 1
            if tally.broke[kind, found.broke] <= KEPT:
                _keep(place, out / f"{tally.broke.total():04d}", words, found)
        shutil.rmtree(place, ignore_errors=True)
        tally.seconds[kind] += _spent() - before
    return tally


def _spent() -> float:
    """Processor time of this process and of those that have ended, s."""
    return sum(used.ru_utime + used.ru_stime for used in map(resource.getrusage, _WHO))


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
    parser.add_argument("--cases", type=int, default=10**9, help="at most")
    parser.add_argument("--fast", action="store_true", help="without simulate, excite and gap, which compile")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=Path, help="a folder of sound logs to damage, too")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--again", type=Path, help="run a kept case again")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    if args.again:
        print(again(args.again))
        return
    preload()
    with tempfile.TemporaryDirectory(prefix="sysid-seeds-") as folder:
        tally = hunt(Seeds.made(Path(folder), args.logs), args.seconds, args.cases, args.seed, args.out, args.fast)
    publish("bench/robustness/fuzz.py", tally.text(), args.page)


if __name__ == "__main__":
    main()
