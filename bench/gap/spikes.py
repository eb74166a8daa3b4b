"""Spike and recovery: ``sysid gap`` on real records with a known effect put in.

    python -m bench.gap.spikes --set development --cases 40 --ledger out/spikes.jsonl \
        [--page docs/results/gap_spikes.md]

The first cases are the records as they are; in the others an effect drawn at random is put into the record, or into
what is believed of the aircraft. The diagnosis gets the flights and the aircraft file alone. Cases of the ledger are
not diagnosed again: the same command goes on where it stopped. ``--judge`` diagnoses nothing and scores the ledger.
Needs the folder of flight records, which is not part of the project.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

from bench.pages import publish
from bench.spikes import ledger, scores
from bench.spikes.drawing import SETS, Case, draw
from bench.spikes.editing import edited, misbelieved
from bench.spikes.excusing import ratio_left
from bench.spikes.records import FLIGHTS, Flight, belief, part, rate_of
from bench.withheld.ledger import version
from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.document import document
from sysid_node.gap.flightdata.gap_flight import GapFlight, completed_flights


def main() -> None:
    """Diagnose the cases that the ledger lacks, and print the tables or put them in the documentation."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "flights"
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=Path, default=Path(os.environ.get("SYSID_FLIGHTS", beside)))
    parser.add_argument("--set", choices=SETS, default="development", help="of seeds; the final one is for the end")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--only", nargs="+", metavar="FLIGHT", help="only cases of these flights")
    parser.add_argument("--until", help="begin no case after this time of day, HH:MM, of the same day or the next")
    parser.add_argument("--judge", action="store_true", help="score the ledger, diagnose nothing")
    parser.add_argument("--ledger", type=Path, required=True, help="file of diagnosed cases, to count and to add to")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    if not args.judge:
        if not args.flights.is_dir():
            print(f"flight records not found at {args.flights}: nothing to diagnose; give their folder as --flights")
            return
        _diagnose_missing(args)
    publish(f"bench/gap/spikes.py {args.set}", scores.page(ledger.read(args.ledger)), args.page)


def _diagnose_missing(args: argparse.Namespace) -> None:
    known = {row["seed"] for row in ledger.read(args.ledger)}
    end = _time_of(args.until)
    for seed in range(args.first, args.first + args.cases):
        case = draw(args.flights, args.set, seed)
        if seed in known or (args.only and case.flight not in args.only) or time.time() > end:
            continue
        line = diagnosed(args.flights, case)
        ledger.add(args.ledger, line)
        said = ", ".join(f"{c['label']} {c['probability']:.2f}" for c in line["causes"]) or line["refusal"]
        put = f"{case.effect} {dict(case.values)}"
        print(f"{seed} {case.flight} {put}: {line['verdict']} {said} [{line['seconds']} s]", flush=True)


def _time_of(until: str | None) -> float:
    """The next time (s since the epoch) at which a clock shows HH:MM; never without one."""
    if until is None:
        return float("inf")
    now = time.localtime()
    minutes = (int(until[:2]) - now.tm_hour) * 60 + int(until[3:]) - now.tm_min
    return time.time() + 60.0 * (minutes % (24 * 60))


def diagnosed(folder: Path, case: Case, flight: Flight | None = None) -> dict[str, Any]:
    """The line of a case: put into the flights and the belief, then diagnosed; its own flight unless one is given."""
    flight = flight or FLIGHTS[case.flight]
    aircraft = misbelieved(belief(folder, flight), case.effect, case.values)
    records = [
        [edited(part(folder, flight, span), case.effect, case.values) for span in spans]
        for spans in (flight.fitted, flight.held)
    ]
    begin, said, refusal = time.process_time(), None, ""
    try:
        fitted, held = (
            [gap_flight(aircraft, record, f"{name} {number}") for number, record in enumerate(group)]
            for name, group in zip(("fitted", "held"), records, strict=True)
        )
        said = document(diagnose(aircraft, fitted, held))
    except InputError as error:
        refusal = str(error)
    seconds = time.process_time() - begin
    left = ratio_left(folder, case) if case.effect else None
    return ledger.row(case, left, said, refusal, seconds, version())


def gap_flight(aircraft: Aircraft, record: FlightRecord, source: str) -> GapFlight:
    """A record as a diagnosis takes it. Raises InputError."""
    rate = rate_of(record)
    [whole] = completed_flights(aircraft, GapFlight(record, rate, rate, rate, source=source))
    return whole


if __name__ == "__main__":
    main()
