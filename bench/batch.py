"""The batch estimators: published analyses, intervals by Monte Carlo, the bundled flights. `python bench/batch.py`

Published analyses of real flights need the folder of flight records, which is not part of the project.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from evaluation.batch import intervals
from evaluation.pages import publish

ROOT = Path(__file__).resolve().parents[1]


def main() -> None:
    """Print the sections, or put them in the documentation."""
    beside = ROOT.parent / "shared" / "flights"
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=("published", "coverage"), help="one section")
    parser.add_argument("--flights", type=int, default=200, help="simulated ones for the coverage (default: 200)")
    parser.add_argument("--method", help="coverage of this method only")
    parser.add_argument("--air", help="coverage in this air only, as the table calls it")
    parser.add_argument("--results", type=Path, help="CSV file that keeps the coverage's lines as they come")
    parser.add_argument("--records", type=Path, default=Path(os.environ.get("SYSID_FLIGHTS", beside)))
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    if args.only in (None, "published"):
        if args.records.is_dir():
            sys.path.append(str(ROOT / "test" / "batch"))  # the cases are the tests'
            from evaluation.batch import published  # noqa: PLC0415 - not found before

            publish("bench/batch.py published", published.section(args.records), args.page)
        else:
            print(f"flight records not found at {args.records}: nothing to compare; give their folder as --records")
    if args.only in (None, "coverage"):
        chosen = ((trial, {args.method, args.air} - {None}) for trial in intervals.TRIALS)
        trials = [trial for trial, wanted in chosen if wanted <= {trial.method, trial.air}]
        publish("bench/batch.py coverage", intervals.section(trials, args.flights, args.results), args.page)


if __name__ == "__main__":
    main()
