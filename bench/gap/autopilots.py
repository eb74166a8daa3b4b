"""What the diagnosis says of flights in turbulence under the loops of several autopilots.

    python -m bench.gap.autopilots LEDGER [--page docs/results/gap_effects.md]

Flights as ``sysid simulate`` makes them, in light and moderate turbulence, of an aircraft that is as its file says, and
of one whose servos follow with a lag of 0.09 s. Each aircraft flies in gusts of its own, and in the same ones with the
simulator's own autopilot and with the loops of PX4 and ArduPilot. Finished cases are kept in LEDGER, so that the
command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

from bench.pages import publish, table
from bench.speed.diagnosis import flown
from sysid_node import load
from sysid_node.api.gap_diagnosis import diagnose

AIRCRAFT, LOOPS, AIRS = ("cdrw", "cdfp", "kestrel"), ("own", "px4", "ardupilot"), ("light", "moderate")
LAG, TIME = "actuator_lag", 0.09  # s
#: Seeds of the first aircraft's gusts, with nothing withheld and with the lag, and how far those of the next are off.
SEEDS, NEXT = {"nothing": 71, LAG: 72}, 10
NAMED = 0.5  # probability from which on a cause counts as named


@dataclass(frozen=True)
class Case:
    """A flight."""

    aircraft: str
    loops: str
    air: str
    withheld: str


def told(case: Case, folder: Path) -> dict[str, Any]:
    """What is needed of the diagnosis."""
    words = ["--manoeuvre", "3211:repeat=3", "--turbulence", case.air, "--loops", case.loops]
    words += ["--effect", f"{LAG}:time_constant={TIME}"] if case.withheld == LAG else []
    seed = SEEDS[case.withheld] + NEXT * AIRCRAFT.index(case.aircraft)
    bag = flown(folder / "_".join(asdict(case).values()), seed, words, case.aircraft)
    found = diagnose(load(bag, case.aircraft)).document
    causes = [{key: cause[key] for key in ("effect", "parameters", "probability")} for cause in found["causes"]]
    return {**asdict(case), "verdict": found["verdict"], "causes": causes}


def finished(ledger: Path) -> list[dict[str, Any]]:
    """All cases, those that the ledger lacks flown and diagnosed."""
    rows = [json.loads(line) for line in ledger.read_text().splitlines()] if ledger.exists() else []
    known = {Case(*(row[key] for key in Case.__annotations__)) for row in rows}
    with tempfile.TemporaryDirectory() as folder, ledger.open("a", encoding="utf-8") as kept:
        for case in (Case(*one) for one in product(AIRCRAFT, LOOPS, AIRS, SEEDS)):
            if case not in known:
                rows.append(told(case, Path(folder)))
                kept.write(json.dumps(rows[-1]) + "\n")
                kept.flush()
    return rows


def section(rows: Sequence[Mapping[str, Any]]) -> str:
    """The table by loops and air."""
    lines = []
    for loops, air in product(LOOPS, AIRS):
        of = [row for row in rows if (row["loops"], row["air"]) == (loops, air)]
        sound = [row for row in of if row["withheld"] == "nothing"]
        late = [row for row in of if row["withheld"] == LAG]
        silent = sum(row["verdict"] == "no_gap" for row in sound)
        named = sum(any(c["effect"] == LAG for c in row["causes"]) for row in late)
        beside = [f"{c['effect']} {c['probability']:.2f}" for row in late for c in _others(row)]
        times = [pair for row in late for pair in _times(row)]
        mean = sum(value for value, _ in times) / max(len(times), 1)
        hold = sum(abs(value - TIME) <= 1.96 * error for value, error in times)
        lines.append(
            [
                f"{loops}, {air}",
                f"{silent} of {len(sound)}",
                f"{named} of {len(late)}",
                f"{mean:.3f}",
                f"{hold} of {len(times)}",
                ", ".join(beside) or "-",
            ]
        )
    heads = (
        "loops, turbulence",
        "nothing withheld: `no_gap`",
        "lag named",
        "mean time, s",
        "times hold",
        "named beside",
    )
    return table(heads, lines)


def _others(row: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [c for c in row["causes"] if c["effect"] != LAG and c["probability"] >= NAMED]


def _times(row: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Time constants with their standard errors, s; one that all controls share counts once."""
    lags = [c["parameters"] for c in row["causes"] if c["effect"] == LAG]
    return [(value, error) for parameters in lags for key, (value, error) in parameters.items() if key != "damping"]


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ledger", type=Path, help="file of finished cases (.jsonl)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    publish("bench/gap/autopilots.py", section(finished(args.ledger)), args.page)


if __name__ == "__main__":
    main()
