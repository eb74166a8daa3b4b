"""Whether the probabilities that ``sysid gap`` states mean what they say, over several sets of withheld effects.

    python -m bench.gap.calibration bench/withheld/ledgers/{seeds_820,seeds_1200,final}.jsonl \
        [--page docs/results/gap_scoreboard.md]

Reads ledgers of ``bench/gap/scoreboard.py``: probabilities as they were stated, each set by its own version. One set of
300 cases has few causes in the middle bins; together they have enough to tell chance from what is stated wrongly.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.pages import publish
from bench.withheld import ledger
from bench.withheld.drawing import FOREIGN
from bench.withheld.scoreboard import calibration


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", type=Path, help="ledgers of sets")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    cases = [case for path in args.sets for case in ledger.read(path).values()]
    own = [case for case in cases if case.label["plant"] != FOREIGN]
    parts = [f"{len(cases)} cases of {len(args.sets)} sets:", calibration([s for c in cases for s in c.stated])]
    parts += [f"{len(own)} of the own plants:", calibration([s for c in own for s in c.stated])]
    publish("bench/gap/calibration.py", "\n\n".join(parts), args.page)


if __name__ == "__main__":
    main()
