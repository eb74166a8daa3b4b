"""Every method on the same bundled flights, beside the online estimator.

python -m bench.batch.methods
"""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.batch.comparison import METHODS, section
from bench.pages import publish

#: Flights to estimate from, each with the one that checks the estimates.
FLIGHTS = {
    "cdrw_multistep": "cdrw_random",
    "cdrw_random": "cdrw_turbulence",
    "cdrw_near_stall": "cdrw_multistep",
}


def main() -> None:
    """Print the sections, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=FLIGHTS, help="one flight")
    parser.add_argument("--without", action="append", default=[], choices=METHODS, help="a method to leave out")
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    for name, holdout in FLIGHTS.items():
        if args.only in (None, name):
            publish(f"bench/batch/methods.py {name}", section(name, holdout, args.without), args.page)


if __name__ == "__main__":
    main()
