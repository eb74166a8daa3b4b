"""The scoreboard of ``sysid gap`` on withheld effects.

    python -m bench.gap.scoreboard --set development --cases 40 --out out/withheld \
        [--page docs/results/gap_scoreboard.md]

Effects drawn at random are flown by plants in processes of their own, which hand over bags and an aircraft file; the
label is sealed until the diagnosis is written. Finished cases are kept: the same command goes on where it stopped.
``--judge`` flies and diagnoses nothing more, and scores what is there. ``--ledger`` keeps what was judged, a line a
case: cases in it are not flown again, and count; a ledger holds one version of the diagnosis only.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bench.pages import publish
from bench.withheld import judging, ledger, scoreboard
from bench.withheld.closing import closed
from bench.withheld.drawing import FOREIGN, SETS, Case, draw

#: Minutes of a day.
_DAY = 24 * 60


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--set", choices=SETS, default="development", help="of seeds; the final one is for the end")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--first", type=int, default=1, help="number of the first case")
    parser.add_argument("--plants", nargs="+", help="only cases of these (default: all)")
    parser.add_argument("--kinds", nargs="+", help="only cases of these kinds (default: all)")
    parser.add_argument("--until", help="begin no case after this time of day, HH:MM")
    parser.add_argument("--fly", action="store_true", help="fly the cases, diagnose nothing yet")
    parser.add_argument("--judge", action="store_true", help="score what is there, fly nothing")
    parser.add_argument(
        "--out", type=Path, default=Path("out/withheld"), help="where cases are kept (default: out/withheld)"
    )
    parser.add_argument("--ledger", type=Path, help="file of judged cases, to count and to add to")
    parser.add_argument(
        "--further", type=int, default=1, metavar="N", help="every Nth case flies three times more (default: 1)"
    )
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    folder = args.out.resolve() / args.set
    judged, failed = [], []
    known = _known(args.ledger, more=not args.judge)
    for seed in range(args.first, args.first + args.cases):
        case = draw(args.set, seed)
        if (args.plants and case.plant not in args.plants) or (args.kinds and case.kind not in args.kinds):
            continue
        if seed in known:
            judged.append(known[seed])
            continue
        if not args.judge and not _over(args.until):
            _finish(args.set, case, folder, fly_only=args.fly, further=seed % args.further == 0)
        for fresh in _judged(args.set, folder, seed):
            judged.append(fresh)
            if args.ledger is not None:
                ledger.add(args.ledger, fresh, list(ledger.weighed_by(fresh.label, _said(folder / str(seed)))))
        failed += [said for said in _failed(folder / str(seed)) if not said.startswith("diagnosis")]
    publish(f"bench/gap/scoreboard.py {args.set}", scoreboard.page(judged, failed), args.page)


def _known(path: Path | None, *, more: bool) -> dict[int, judging.Judged]:
    """The cases of a ledger; ``more``: to which this version's are to be added."""
    try:
        return ledger.read(path, ledger.version() if more else None)
    except ValueError as error:
        sys.exit(f"gap_scoreboard: {error}")


def _failed(case: Path) -> list[str]:
    """What ended a case before it was diagnosed, if anything did."""
    return [path.read_text(encoding="utf-8").strip() for path in case.glob("failed.txt")]


def _over(until: str | None) -> bool:
    """Whether a time of day has come: twelve hours before it, it has not, whatever midnight lies between."""
    if until is None:
        return False
    wanted, now = (60 * int(said[:2]) + int(said[3:]) for said in (until, time.strftime("%H:%M")))
    return (wanted - now) % _DAY > _DAY // 2 or wanted == now


def _finish(which: str, truth: Case, folder: Path, *, fly_only: bool, further: bool) -> None:
    """Flies and diagnoses a case as far as it is not done; a line on how it went."""
    seed = truth.seed
    out = folder / str(seed) / "out"
    if (out / "gap.json").exists() or (folder / str(seed) / "failed.txt").exists():
        return
    if not (folder / "labels" / f"{seed}.json").exists():
        words = [sys.executable, "-m", "bench.withheld.plants.plant", which, str(seed), str(folder)]
        if _run(words, folder, seed, "plant"):
            return
    if fly_only:
        return
    case = folder / str(seed)
    bags = [str(case / "fitted"), "--holdout", str(case / "held"), "--aircraft", str(case / "aircraft.yaml")]
    words = [sys.executable, "-m", "sysid_node.cli", "gap", *bags, "--quiet", "--out", str(out)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    if _run(words, folder, seed, "diagnosis"):
        return
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    (case / "seconds.txt").write_text(f"{seconds:.1f}\n", encoding="utf-8")
    if further and truth.plant != FOREIGN and truth.kind != "unlisted":  # what the simulator can fly as it is
        _run([sys.executable, "-m", "bench.withheld.covering", which, str(seed), str(folder)], folder, seed, "covering")
    for judged in _judged(which, folder, seed):
        print(seed, judging.line(judged), flush=True)


def _run(words: list[str], folder: Path, seed: int, what: str) -> int:
    """Exit status; what failed is kept beside the case, so that it is neither forgotten nor tried for ever."""
    done = subprocess.run(words, check=False, cwd=Path(__file__).resolve().parents[2], capture_output=True, text=True)
    if done.returncode and not (folder / str(seed) / "out" / "gap.json").exists():
        case = folder / str(seed)
        case.mkdir(parents=True, exist_ok=True)
        said = (done.stderr or done.stdout).strip().splitlines()[-1:]
        (case / "failed.txt").write_text(f"{what}: {' '.join(said)}\n", encoding="utf-8")
        print(seed, what, "failed:", *said, flush=True)
        return done.returncode
    return 0


def _judged(which: str, folder: Path, seed: int) -> Iterator[judging.Judged]:
    """The case as it was judged, where it was diagnosed or the diagnosis failed."""
    found, label = folder / str(seed) / "out" / "gap.json", folder / "labels" / f"{seed}.json"
    if (found.exists() or _ended(folder / str(seed))) and label.exists():
        truth = json.loads(label.read_text(encoding="utf-8"))
        judged = judging.judge(truth, _said(folder / str(seed)))
        named = judged.right and judged.kind in ("one", "two")
        flown = closed(truth, which, folder / str(seed)) if named else None
        kept = folder / str(seed) / "covered.json"
        further = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else None
        yield replace(judged, flown=flown, further=further)


def _ended(case: Path) -> bool:
    """Whether the diagnosis of a case ended without a verdict."""
    return any(said.startswith("diagnosis") for said in _failed(case))


def _said(case: Path) -> Mapping[str, Any]:
    """What the diagnosis said of a case."""
    if _ended(case):
        return judging.FAILURE
    said: Mapping[str, Any] = json.loads((case / "out" / "gap.json").read_text(encoding="utf-8"))
    return said


if __name__ == "__main__":
    main()
