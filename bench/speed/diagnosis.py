"""What ``sysid gap`` costs: 60 s at 100 Hz against every effect, programs kept and not, and two flights.

    python -m bench.speed.diagnosis [--repeat 3] [--page docs/results/cost.md]

The flights are flown first (cdrw, light turbulence, an actuator's lag). Run it on an idle machine: times by the clock
tell of that machine only, the ratio of two flights to one of any.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from bench.pages import publish, table

_SYSID = (sys.executable, "-m", "sysid_node.cli")
_AIRCRAFT = "cdrw"
_SURFACES = ("elevator", "aileron", "rudder")
_FLIGHT = (
    *("--effect", "actuator_lag:time_constant=0.09", "--turbulence", "light", "--rate", "100", "--duration", "60"),
    *(word for surface in _SURFACES for word in ("--manoeuvre", f"3211:{surface}:repeat=6")),
)


class Cost(NamedTuple):
    """Of one process."""

    clock: float  # s
    processor: float  # s, of all its threads
    memory: float  # GB, at its peak


def main() -> None:
    """Print the table, or put it in a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3, help="times that each is run with programs kept (default: 3)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        text = _measured(Path(folder), args.repeat)
    publish("bench/speed/diagnosis.py", text, args.page)


def _measured(folder: Path, repeat: int) -> str:
    one, other = (flown(folder / f"flight_{seed}", seed) for seed in (3, 4))
    diagnosed([one], folder, "first")  # reads what every later run finds in the machine's memory
    cold, runs = diagnosed([one], folder, "cold"), {}
    for name, bags in (("the same, programs kept", [one]), ("another flight", [other]), ("both", [one, other])):
        diagnosed(bags, folder, "warm")
        runs[name] = [diagnosed(bags, folder, "warm") for _ in range(repeat)]
    rows = [_row("one flight, no programs kept", [cold]), *(_row(name, costs) for name, costs in runs.items())]
    single, second, both = (_processor(costs) for costs in runs.values())
    heads = ("", "by the clock, s", "processor time, s", "peak memory, GB")
    share = f"Both flights take {both / (single + second):.2f} of the processor time that each takes alone, added up."
    return f"{table(heads, rows)}\n\n{os.cpu_count()} processors; medians of {repeat}. {share}"


def flown(bag: Path, seed: int, flight: Sequence[str] = _FLIGHT, aircraft: str = _AIRCRAFT) -> Path:
    """A simulated flight, by the arguments of ``sysid simulate``."""
    words = [*_SYSID, "simulate", "--aircraft", aircraft, *flight, "--seed", str(seed), "--out", str(bag), "--quiet"]
    subprocess.run(words, check=True, capture_output=True)
    return bag


def diagnosed(
    bags: Sequence[Path], folder: Path, cache: str, simulator: Sequence[str] = ("--aircraft", _AIRCRAFT)
) -> Cost:
    """One diagnosis in a process of its own, with programs kept in a cache of this name."""
    words = [*_SYSID, "gap", *map(str, bags), *simulator, "--quiet", "--out", str(folder / "out")]
    before = os.times().elapsed
    with (folder / "said").open("w") as said:
        process = subprocess.Popen(
            words, env={**os.environ, "XDG_CACHE_HOME": str(folder / cache)}, stdout=said, stderr=said
        )
        _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"gap_cost: {' '.join(words)}: {(folder / 'said').read_text(encoding='utf-8').strip()}")
    return Cost(os.times().elapsed - before, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e6)


def _processor(costs: list[Cost]) -> float:
    return statistics.median(cost.processor for cost in costs)


def _row(name: str, costs: list[Cost]) -> list[str]:
    times = [cost.clock for cost in costs]
    spread = f" ({min(times):.1f}-{max(times):.1f})" if len(costs) > 1 else ""
    memory = max(cost.memory for cost in costs)
    return [name, f"{statistics.median(times):.1f}{spread}", f"{_processor(costs):.1f}", f"{memory:.2f}"]


if __name__ == "__main__":
    main()
