"""The estimator on real flights, beside the field's own programs.

    python -m bench.estimation.real_flights [--flights FOLDER]

DHC-6 Twin Otter, VFW-614 ATTAS, HFB-320 and the small UAV Thor, replayed as a user would, and regressed in the form in
which the references are stated. Then by aircraft files with tolerances, from commands, and one flight against another
of the same aircraft. Needs the folder of flight records, which is not part of the project.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from bench.estimation.real import attas, cut, hfb320, repeats, thor, twin_otter, without_vanes
from bench.pages import publish

SECTIONS = {
    "twin_otter": twin_otter.section,
    "attas": attas.section,
    "hfb320": hfb320.section,
    "thor": thor.section,
    "thor_ordinary": thor.ordinary_section,
    "cut": cut.section,
    "repeats": repeats.section,
    "without_vanes": without_vanes.section,
}


def main() -> None:
    """Print the sections, or put them in the documentation."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "flights"
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=Path, default=Path(os.environ.get("SYSID_FLIGHTS", beside)))
    parser.add_argument("--only", choices=SECTIONS, help="one section")
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    if not args.flights.is_dir():
        print(f"flight records not found at {args.flights}: nothing to compare; give their folder as --flights")
        return
    for name, section in SECTIONS.items():
        if args.only in (None, name):
            publish(f"bench/estimation/real_flights.py {name}", section(args.flights), args.page)


if __name__ == "__main__":
    main()
