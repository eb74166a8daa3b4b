"""What a fleet's statistics are worth, on fleets drawn from their model.

    python -m bench.fleet.statistics

Coverage of the intervals of means and scatters, false drifts, whether the four events are found and put to the right
account, and the errors of estimates with the fleet's prior. `--events` draws fleets with the events, `--quiet-fleets`
without. `--wear` is what the worn tail loses; with another value than usual only what depends on it is printed.
Finished fleets are kept in `--ledger`, a line each, so that the command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from bench.fleet.drawn_fleets import (
    CONFUSED,
    LACKING,
    NAMES,
    SLOW,
    VANE_CAUSE,
    WEAR,
    Truth,
    draw_fleet,
    sizes_of,
    statistical_covariance,
)
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.fleet.statistics.summarise import summarise
from sysid_node.fleet.statistics.summary import FleetSummary

Row = dict[str, Any]


def judge_fleet(seed: int, *, events: bool, wear: float = WEAR) -> Row:
    """The judgement of one fleet: counts, and errors in units of the derivative's size."""
    results, truth = draw_fleet(seed, events=events, wear=wear)
    found = summarise(results)
    row: Row = {"seed": seed, "events": events, "wear": wear, **_coverage(found, truth), **_drift(found, truth)}
    row["apart"] = sum(d.significant for d in found.deviations.values())
    if events:
        row |= _accounts(found, truth)
    return row | _next_flights(found, truth, seed)


def _coverage(found: FleetSummary, truth: Truth) -> Row:
    """Which of the 95 % intervals hold the truth, a list for each kind."""
    held: dict[str, list[bool]] = {"mean": [], "tails": [], "flights": []}
    for key, population in found.populations.items():
        fit = population.fit
        held["mean"].append(bool(fit.lower <= truth.means[key] <= fit.upper))
        held["tails"].append(bool(fit.tails.lower <= truth.tail_scatter[key] <= fit.tails.upper))
        held["flights"].append(bool(fit.flights.lower <= truth.flight_scatter[key] <= fit.flights.upper))
    return {f"{kind}_held": sum(each) for kind, each in held.items()} | {"intervals": len(held["mean"])}


def _drift(found: FleetSummary, truth: Truth) -> Row:
    called = [(tail, name) for (_, tail, name), drift in found.drifts.items() if drift.significant]
    false = [pair for pair in called if pair not in truth.drifting]
    return {"drifts": len(called), "false_drifts": len(false), "false_share": len(false) / max(len(called), 1)}


def _accounts(found: FleetSummary, truth: Truth) -> Row:
    """Whether each of the four events was found and put to the right account."""
    drifts = {(tail, name): drift for (_, tail, name), drift in found.drifts.items() if drift.significant}
    shared = {(c.aircraft, c.label) for c in found.causes if c.shared >= 0.5}
    own = {(t.tail, c.label): t for c in found.causes for t in c.tails if t.own >= 0.5}
    vane = own.get((truth.vane, VANE_CAUSE))
    right = {(truth.slow, SLOW), (truth.vane, VANE_CAUSE)}
    return {
        "worn": (truth.worn, "Cl_da") in drifts,
        "slow": (truth.slow, SLOW) in own and not any(label in {SLOW, CONFUSED[SLOW]} for _, label in shared),
        "vane": vane is not None and not any(label == VANE_CAUSE for _, label in shared),
        "vane_drift": (truth.vane, "CL_0") in drifts,
        "lacking": sum(label == LACKING for _, label in shared) == len(found.tails),
        "wrong_shared": sum(label != LACKING for _, label in shared),
        "wrong_own": len(set(own) - right),
    }


def _next_flights(found: FleetSummary, truth: Truth, seed: int) -> Row:
    """Squared errors of one more flight of each tail, alone and with the prior, where it says much and little."""
    generator = np.random.default_rng([seed, 2024])
    sums = {"much": np.zeros(4), "little": np.zeros(4)}
    for (aircraft, tail), priors in found.priors.items():
        file = load_aircraft(aircraft)
        sizes = sizes_of(file)
        S = statistical_covariance(generator, sizes)
        noise = generator.multivariate_normal(np.zeros(sizes.size), S)
        for k, name in enumerate(NAMES):
            flown = (
                truth.tails[aircraft, tail, name] + truth.flight_scatter[aircraft, name] * generator.standard_normal()
            )
            estimate = flown + 0.02 * sizes[k] * truth.systematic[aircraft, tail][k] + noise[k]
            error = math.sqrt(S[k, k])
            if (tail, name) in truth.drifting or name not in priors:
                continue
            value, stated, _ = priors[name].combined(estimate, error)
            half = 1.96 * stated
            kind = "little" if error > 0.06 * sizes[k] else "much"
            sums[kind] += [
                ((estimate - flown) / sizes[k]) ** 2,
                ((value - flown) / sizes[k]) ** 2,
                abs(value - flown) <= half,
                1,
            ]
    return {f"next_{kind}": each.tolist() for kind, each in sums.items()}


def share(right: float, of: int) -> str:
    """A share in percent with its 95 % interval (Clopper & Pearson 1934)."""
    if not of:
        return "-"
    low = stats.beta.ppf(0.025, right, of - right + 1) if right else 0.0
    high = stats.beta.ppf(0.975, right + 1, of - right) if right < of else 1.0
    return f"{100 * right / of:.1f} % ({100 * low:.0f}-{100 * high:.0f} %) of {of}"


def report(rows: Sequence[Row]) -> str:
    """The tables of the page."""
    events = [row for row in rows if row["events"]]
    still = [row for row in rows if not row["events"]]
    held = [share(total(rows, f"{kind}_held"), total(rows, "intervals")) for kind in ("mean", "tails", "flights")]
    false = f"{100 * np.mean([row['false_share'] for row in events]):.1f} % of {len(events)} fleets"
    lines = [
        ("95 % interval of a type's mean holds it", held[0], "95 %"),
        ("95 % interval of the scatter of tails holds it", held[1], "95 %"),
        ("95 % interval of the scatter of flights holds it", held[2], "95 %"),
        ("nothing drifts: any drift called", share(sum(r["drifts"] > 0 for r in still), len(still)), "5 % at most"),
        ("no tail is odd: any called so", share(sum(r["apart"] > 0 for r in still), len(still)), "5 % at most"),
        ("share of false drifts among those called", false, "5 % at most"),
        ("worn tail: its aileron power drifts", share(total(events, "worn"), len(events)), "90 %"),
        ("slow servo put to its tail, and to no type", share(total(events, "slow"), len(events)), "90 %"),
        ("mis-set vane put to its tail, and to no type", share(total(events, "vane"), len(events)), "90 %"),
        ("missing effect put to the simulator", share(total(events, "lacking"), len(events)), "90 %"),
        ("causes wrongly put to the simulator", f"{total(events, 'wrong_shared')} in {len(events)} fleets", ""),
        ("causes wrongly put to a tail", f"{total(events, 'wrong_own')} in {len(events)} fleets", ""),
    ]
    return "\n\n".join([table(("", "found", "wanted"), lines), _prior_table(rows)])


def report_of_wear(rows: Sequence[Row], wear: float) -> str:
    """What depends on the worn tail, in fleets in which it loses another share."""
    false = f"{100 * np.mean([row['false_share'] for row in rows]):.1f} % of {len(rows)} fleets"
    found = share(total(rows, "worn"), len(rows))
    lines = [
        (f"worn tail, {100 * wear:.0f} % in the year: its aileron power drifts", found, "90 %"),
        ("share of false drifts among those called", false, "5 % at most"),
    ]
    return table(("", "found", "wanted"), lines)


def total(rows: Sequence[Row], key: str) -> int:
    """The sum of a count over fleets."""
    return sum(int(row[key]) for row in rows)


def _prior_table(rows: Sequence[Row]) -> str:
    lines = []
    for kind, words in (("much", "says much"), ("little", "says little (error above 6 %)")):
        alone, combined, covered, count = np.sum([row[f"next_{kind}"] for row in rows], axis=0)
        rms = [f"{100 * math.sqrt(s / count):.2f} %" for s in (alone, combined)]
        lines.append((f"the flight {words}", *rms, share(covered, int(count))))
    return table(
        ("one more flight of each tail", "error alone", "with the fleet's prior", "95 % intervals hold"), lines
    )


def _read(ledger: Path) -> list[Row]:
    return [json.loads(line) for line in ledger.read_text(encoding="utf-8").splitlines()] if ledger.exists() else []


def main() -> None:
    """Judges what is missing, and prints or publishes the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=int, default=150, help="fleets with the events")
    parser.add_argument("--quiet-fleets", type=int, default=150, help="fleets without")
    parser.add_argument("--first-seed", type=int, default=0, help="seed of the first fleet of either kind")
    parser.add_argument(
        "--wear", type=float, default=WEAR, help="share that the worn tail loses (default: %(default)s)"
    )
    parser.add_argument("--ledger", type=Path, default=Path("out/fleet_statistics.jsonl"))
    parser.add_argument("--page", type=Path, help="page to fill, e.g. docs/results/fleet.md")
    args = parser.parse_args()
    usual = args.wear == WEAR
    quiet = args.quiet_fleets if usual else 0
    counts = {True: args.events, False: quiet}
    wanted = [(e, args.first_seed + k) for k in range(max(counts.values())) for e in (True, False) if k < counts[e]]
    rows = _judged(wanted, args.wear, args.ledger)
    if usual:
        publish("bench/fleet/statistics.py", report(rows), args.page)
    else:
        publish("bench/fleet/statistics.py --wear", report_of_wear(rows, args.wear), args.page)


def _judged(wanted: Sequence[tuple[bool, int]], wear: float, ledger: Path) -> list[Row]:
    """The judgements of fleets with events or without, by their seeds; those that the ledger lacks are added to it."""
    ledger.parent.mkdir(parents=True, exist_ok=True)
    of_wear = [row for row in _read(ledger) if row.get("wear", WEAR) == wear]
    done = {(row["events"], row["seed"]): row for row in of_wear}
    for events, seed in wanted:
        if (events, seed) not in done:
            done[events, seed] = judge_fleet(seed, events=events, wear=wear)
            with ledger.open("a", encoding="utf-8") as file:
                file.write(json.dumps(done[events, seed]) + "\n")
    return [done[key] for key in wanted]


if __name__ == "__main__":
    main()
