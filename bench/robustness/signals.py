"""Ctrl-C and SIGTERM at random times in every command: exit code, lines on stderr, and what is left behind.

A command that is done before the signal arrives counts as such. What is left behind is anything in the folder of
``--out`` but finished results, and finished steps of a diagnosis.

    python -m bench.robustness.signals [--times 20] [--seed 1] [--only replay,gap]
"""

from __future__ import annotations

import argparse
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BAG = str(ROOT / "bags" / "cdrw_multistep")
#: The words of each command, and how long it takes on an idle computer, s.
COMMANDS = {
    "replay": (["replay", BAG, "--aircraft", "cdrw"], 8.0),
    "identify": (["identify", BAG, "--aircraft", "cdrw", "--method", "equation_error"], 5.0),
    "identify_output_error": (["identify", BAG, "--aircraft", "cdrw", "--method", "output_error"], 20.0),
    "simulate": (["simulate", "--aircraft", "cdrw", "--manoeuvre", "3211"], 10.0),
    "excite": (["excite", "--aircraft", "cdrw", "--manoeuvre", "doublet"], 10.0),
    "gap": (["gap", BAG, "--aircraft", "cdrw"], 30.0),
    "export": (["export", "cdrw", "--format", "jsbsim"], 3.0),
}
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}


def ended(words: list[str], number: signal.Signals, after: float) -> str:
    """How a command ended that was sent a signal some time (s) after its start, in words; "as it should" if so."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out")
        command = [sys.executable, "-m", "sysid_node.cli", *words, "--out", str(out), "--quiet"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT) as process:
            time.sleep(after)
            process.send_signal(number)
            try:
                _, said = process.communicate(timeout=60.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                return "did not end within 60 s"
        if process.returncode == 0:
            return "was done"
        left = [path.name for path in Path(folder).iterdir()]
        within = {path.name for path in out.iterdir()} if out.is_dir() else set()
        if process.returncode != CODES[number]:
            return f"exit {process.returncode}, {said.strip().splitlines()[-1:]}"
        if len(said.splitlines()) != 1:
            return f"{len(said.splitlines())} lines: {said.strip().splitlines()[-1:]}"
        return "as it should" if left in ([], ["out"]) and within <= {"unfinished"} else f"left {left}, {within}"


def main() -> None:
    """Try all commands and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=20, help="of each signal")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default=",".join(COMMANDS))
    args = parser.parse_args()
    rng = random.Random(args.seed)
    print("| command | signal | as it should | was done | else |\n|---|---|---:|---:|---|")
    for name in args.only.split(","):
        words, seconds = COMMANDS[name]
        for number in CODES:
            found = Counter(ended(words, number, rng.uniform(0.15, seconds)) for _ in range(args.times))
            good, done = found.pop("as it should", 0), found.pop("was done", 0)
            print(f"| {name} | {number.name} | {good} | {done} | {dict(found) or ''} |", flush=True)


if __name__ == "__main__":
    main()
