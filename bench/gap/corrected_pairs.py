"""The second diagnosis with the corrected file, of every pair of effects of the check with JSBSim.

    python -m bench.gap.corrected_pairs --ledger out/pairs.jsonl [--page docs/results/gap_again.md]

Each two of the effects that ``bench/withheld/jsbsim/drawing.py`` lists are flown together, with sizes drawn from its
spans, otherwise as in ``bench.gap.corrected_file``: still air, a file that states servos of 30 ms and whose derivatives
are off by draws from their tolerances. A pair is added to the ledger as it ends; started again, the bench goes on.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from bench.gap.corrected_file import Case, flown_aircraft, told
from bench.pages import publish, table
from bench.withheld.jsbsim.drawing import INSTRUMENT, MODEL, SERVO, sized
from sysid_node.errors import InputError

#: Word before each draw's number in the seeds.
_SEED = 20261125

#: Every pair, as it is numbered.
PAIRS = tuple(combinations([*SERVO, *MODEL, *INSTRUMENT], 2))

Found = Mapping[str, Any]


def main() -> None:
    """Print the tables, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ledger", type=Path, required=True, help="a line of JSON a pair")
    parser.add_argument("--most", type=int, default=len(PAIRS), help="pairs to have in the ledger")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    lines = args.ledger.read_text(encoding="utf-8").splitlines() if args.ledger.exists() else []
    found = [json.loads(line) for line in lines]
    for number in range(len(found), args.most):
        found.append(_one(number))
        with args.ledger.open("a", encoding="utf-8") as file:
            file.write(json.dumps(found[-1]) + "\n")
        print(" | ".join(_row(found[-1])), flush=True)
    publish("bench/gap/corrected_pairs.py", _page(found), args.page)


def _one(number: int) -> dict[str, Any]:
    """Both diagnoses of one pair, or why the pair cannot be flown or diagnosed."""
    flown = _words(PAIRS[number], np.random.default_rng([_SEED, number]))
    pair = {"pair": PAIRS[number], "flown": flown}
    try:
        return {**pair, **told(Case("", flown, servos=True), 1000 + number)}
    except InputError as error:
        return {**pair, "failed": str(error)}


def _words(pair: Sequence[str], random: np.random.Generator) -> tuple[str, ...]:
    """The effects as ``sysid simulate --effect`` takes them; a lag is added to the servo's own."""
    aircraft = flown_aircraft(servos=True)
    words = []
    for effect in pair:
        ((key, size),) = sized(effect, aircraft, random).items()
        own = aircraft.effect_values().get(effect, {}).get(key, 0.0) if effect == "actuator_lag" else 0.0
        words.append(f"{effect}:{key}={own + size:.4g}")
    return tuple(words)


def _named(found: Found) -> list[str]:
    """Of the two effects, those that the first diagnosis names, or has among the first alternatives of a cause."""
    said = [{c["effect"], *c["indistinguishable_from"][:2]} for c in found["first"]["causes"]]
    return [effect for effect in found["pair"] if any(effect in each for each in said)]


def _ends(found: Found) -> str:
    """How the second diagnosis ends: no gap, with causes, or neither."""
    second = found["second"]
    if second["verdict"] == "no_gap":
        return "`no_gap`"
    return "what is left is named" if second["causes"] else "something unknown is left"


def _page(found: Sequence[Found]) -> str:
    flown = [each for each in found if "failed" not in each]
    both, other = ([f for f in flown if (len(_named(f)) == 2) == wanted] for wanted in (True, False))
    heads = ["second diagnosis", "all pairs", "both effects named at first", "one or none named at first"]
    kinds = ("`no_gap`", "what is left is named", "something unknown is left")
    rows = [[kind, *(_count(kind, group) for group in (flown, both, other))] for kind in kinds]
    rows.append(["gap left by the first diagnosis, times the noise floor (median)",
                 *(_median(group) for group in (flown, both, other))])  # fmt: skip
    rest = [_row(each) for each in found if "failed" in each or _ends(each) != "`no_gap`" or len(_named(each)) < 2]
    return "\n\n".join(
        [
            f"{len(found)} of {len(PAIRS)} pairs; {len(found) - len(flown)} cannot be flown or diagnosed.",
            table(heads, rows),
            "Those whose effects were not both named, or whose second diagnosis is not `no_gap`:",
            table(["flown", "first diagnosis", "gap %", "second diagnosis", "gap %", "floor %"], rest),
        ]
    )


def _count(kind: str, group: Sequence[Found]) -> str:
    return f"{sum(_ends(each) == kind for each in group)} of {len(group)}"


def _median(group: Sequence[Found]) -> str:
    gaps = [each["first"]["gap"] for each in group]
    return f"{np.median([gap['after'] / gap['noise_floor'] for gap in gaps]):.2f}" if gaps else "-"


def _row(found: Found) -> list[str]:
    flown = ", ".join(f"`{effect}`" for effect in found["flown"])
    if "failed" in found:
        return [flown, found["failed"], "-", "-", "-", "-"]
    first, second = found["first"], found["second"]
    return [
        flown,
        _told(first),
        _sizes(first),
        _told(second),
        _sizes(second),
        f"{100 * second['gap']['noise_floor']:.1f}",
    ]


def _sizes(said: Found) -> str:
    return " → ".join(f"{100.0 * said['gap'][key]:.1f}" for key in ("before", "after"))


def _told(said: Found) -> str:
    """Verdict and causes with their probabilities."""
    causes = "; ".join(
        " or ".join([c["label"], *c["indistinguishable_from"]]) + f" {c['probability']:.2f}" for c in said["causes"]
    )
    return f"{said['verdict']}: {causes or '-'}"


if __name__ == "__main__":
    main()
