"""How much the gap's decisions depend on its thresholds.

    python -m bench.gap.thresholds record TABLES.json --aircraft cdrw FLIGHT [--holdout FLIGHT] ...   # adds a diagnosis
    python -m bench.gap.thresholds sweep TABLES.json [--ledger bench/withheld/ledgers/final.jsonl] [--page PAGE.md]

``record`` diagnoses flights and keeps the scores from which was decided. ``sweep`` changes one threshold at a time by
factors, decides again from the scores alone, and prints how many verdicts change, and in how many diagnoses the search
for causes would go on otherwise (that would take other fits, which are not made here; the verdict is then that of the
same causes). With a ledger of ``bench/gap/scoreboard.py`` it also prints how many causes of known truth would be
named, rightly and wrongly, by other thresholds of the calibration.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from bench.gap import score_tables
from bench.gap.score_tables import RecordedDiagnosis
from bench.pages import publish, table
from bench.withheld import ledger
from sysid_node.gap.selection.calibration import CauseEvidence, calibrated_probability
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds

#: Factors on each threshold.
FACTORS = (0.5, 0.8, 1.25, 2.0)

#: Thresholds that decide from the recorded scores; the others shape what is measured, or only what is reported.
DECIDING = {
    "admission": ("excitation",),
    "instruments": ("chance",),
    "acceptance": ("probability", "share_of_remainder", "share_of_gap", "noticeable_error", "large_error"),
    "search": ("lead",),
    "calibration": ("constant", "per_log_nat", "flexible", "misspecification", "probability"),
    "validation": ("chance",),
    "verdict": ("told_apart", "structure", "explained", "closed", "error"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    steps = parser.add_subparsers(dest="step", required=True)
    recording = steps.add_parser("record", help="diagnose flights and keep the scores")
    recording.add_argument("tables", type=Path)
    recording.add_argument("flights", type=Path, nargs="+")
    recording.add_argument("--aircraft", required=True)
    recording.add_argument("--holdout", type=Path, action="append", default=[])
    sweeping = steps.add_parser("sweep", help="decide again by other thresholds")
    sweeping.add_argument("tables", type=Path, nargs="+")
    sweeping.add_argument("--ledger", type=Path, action="append", default=[])
    sweeping.add_argument("--only", default=",".join(DECIDING), help="groups of thresholds, with commas between")
    sweeping.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    if args.step == "record":
        record(args.tables, args.flights, args.aircraft, args.holdout)
    else:
        known = [each for path in args.tables for each in score_tables.read(path)]
        causes = [row for path in args.ledger for row in truths(path)]
        publish("bench/gap/thresholds.py", page(known, causes, args.only.split(",")), args.page)


def record(path: Path, flights: Sequence[Path], aircraft: str, holdouts: Sequence[Path]) -> None:
    """Diagnoses flights and adds the scores to a file."""
    from sysid_node.api.flight_file import load  # noqa: PLC0415  # JAX takes its time
    from sysid_node.api.gap_diagnosis import diagnose  # noqa: PLC0415

    loaded, held = ([load(each, aircraft) for each in paths] for paths in (flights, holdouts))
    found = diagnose(loaded, holdout=held).diagnosis
    known = score_tables.read(path) if path.exists() else []
    name = " ".join(str(each) for each in flights)
    score_tables.write(path, [*known, score_tables.recorded(name, found)])
    print(f"{name}: {found.verdict}")


def sweeps(groups: Sequence[str]) -> Iterator[tuple[str, float, Thresholds]]:
    """Name of each deciding threshold, its swept value, and all thresholds with it; shares stay below one."""
    for group in groups:
        values = getattr(THRESHOLDS, group)
        for name in DECIDING[group]:
            usual = getattr(values, name)
            for value in (factor * usual for factor in FACTORS):
                if not 0.0 < usual < 1.0 <= value:
                    yield f"{group}.{name}", value, replace(THRESHOLDS, **{group: replace(values, **{name: value})})


def page(
    known: Sequence[RecordedDiagnosis], causes: Sequence[tuple[CauseEvidence, bool]], groups: Sequence[str]
) -> str:
    """The tables; thresholds that change nothing at any factor are listed by name."""
    rows, idle = [], dict.fromkeys(name for name, _, _ in sweeps(groups))
    for name, value, thresholds in sweeps(groups):
        changes, others = changed(known, thresholds)
        if changes or others:
            idle.pop(name, None)
            words = ", ".join(f"{old} → {new} ({count})" for (old, new), count in changes.most_common())
            rows.append([name, f"{value:.3g}", str(changes.total()), words or "-", str(others)])
    heads = ("threshold", "value", "verdicts that change", "from → to (diagnoses)", "searches that change")
    parts = [f"{len(known)} diagnoses.", table(heads, rows), f"No change at any factor: {', '.join(idle) or 'none'}."]
    return "\n\n".join([*parts, *(named_table(causes) if causes else ())])


def changed(known: Sequence[RecordedDiagnosis], thresholds: Thresholds) -> tuple[Counter[tuple[str, str]], int]:
    """Verdicts that change, old and new, and how many diagnoses would have asked for other fits."""
    pairs = [(each.verdict(THRESHOLDS), each.verdict(thresholds)) for each in known]
    others = sum(each.selection(THRESHOLDS) != each.selection(thresholds) for each in known)
    return Counter(pair for pair in pairs if pair[0] != pair[1]), others


def truths(path: Path) -> Iterator[tuple[CauseEvidence, bool]]:
    """The evidence of every cause of a ledger, and whether it was there."""
    for _, (effect, nats, misspecification, there) in ledger.causes(path):
        yield CauseEvidence(nats, misspecification, effect in THRESHOLDS.calibration.flexible_effects), there


def named_table(causes: Sequence[tuple[CauseEvidence, bool]]) -> list[str]:
    """How many causes of known truth are named by other thresholds of the calibration."""
    rows = [["in use", "", *(str(count) for count in named(causes, THRESHOLDS))]]
    for name, value, thresholds in sweeps(["calibration"]):
        counts = named(causes, thresholds)
        if counts != named(causes, THRESHOLDS):
            rows.append([name, f"{value:.3g}", *(str(count) for count in counts)])
    heads = ("threshold", "value", "named and there", "named and not there", "there, but not named")
    return [f"{len(causes)} causes of known truth, named or doubted:", table(heads, rows)]


def named(causes: Sequence[tuple[CauseEvidence, bool]], thresholds: Thresholds) -> tuple[int, int, int]:
    """Causes that are named and there, named and not there, there and not named."""
    limit = thresholds.calibration.probability
    counts = Counter((calibrated_probability(each, thresholds) >= limit, there) for each, there in causes)
    return counts[True, True], counts[True, False], counts[False, True]


if __name__ == "__main__":
    main()
