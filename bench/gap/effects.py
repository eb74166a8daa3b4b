"""What the diagnosis says of every effect, one at a time.

    python -m bench.gap.effects [--page docs/results/gap_effects.md]

The sizes are those of the pictures in docs/reference/effects.md, none chosen here; so is the aircraft. Two flights in
still air each, 3-2-1-1 to be fitted, multisine held out, a throttle doublet in both; the aircraft file's derivatives
are off by draws from their tolerances. With `--without-vanes` no flow angle is measured. The simulator that flies is
the one that is searched: what is shown is what can be told apart, not how the diagnosis does on another plant
(docs/results/gap_scoreboard.md). Finished effects are kept in `--out`, so that the command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.errors import InputError
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.align import flight_record
from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.document import document
from sysid_node.gap.estimation.candidates import UNOBSERVABLE
from sysid_node.gap.flightdata.flow_angles import ANGLES
from sysid_node.gap.flightdata.gap_flight import GapFlight, completed_flights
from sysid_node.sim import EFFECTS, Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie
from sysid_node.sim.pages.effects_page import AIRCRAFT, EXAMPLES

RATE, DURATION = 100.0, 44.0
THROTTLE = "doublet:throttle:amplitude=0.3:width=2:start=38"
PLANS = (("3211:width=0.4:repeat=2", THROTTLE), ("multisine:length=34:low=0.1:high=2", THROTTLE))
#: Not here: what the vanes measure, noise, and what needs the ground.
SHOWN = [effect for effect in EFFECTS if effect not in UNOBSERVABLE | {"ground_effect"}]


def believed(aircraft: Aircraft, random: np.random.Generator) -> Aircraft:
    """The aircraft file with derivatives off by draws from their tolerances."""
    off = {
        name: Derivative(d.value + (d.tolerance or 0.0) * float(random.standard_normal()), d.tolerance)
        for name, d in aircraft.derivatives.items()
    }
    return replace(aircraft, derivatives=off)


def fly(
    aircraft: Aircraft, belief: Aircraft, effects: Sequence[str], plan: tuple[str, ...], seed: int, vanes: bool
) -> GapFlight:
    """A flight of the aircraft as a bag would hold it, read with the file that is believed."""
    simulator = Simulator(aircraft, RATE)
    deflections = np.zeros((round(DURATION * RATE) + 1, len(simulator.commands)))
    moved = parse_manoeuvre(plan, aircraft, RATE, DURATION).deflections
    for column, name in enumerate(moved):
        deflections[:, column] = moved[name]
    thrust = aircraft.throttle.max_thrust if aircraft.throttle else None
    deflections[:, -1] *= thrust or 1.0
    sortie = fly_sortie(simulator, deflections, SortieConditions(list(effects), seed=seed))
    record = flight_record(belief, FlightSampler(RATE, RATE, RATE).record(sortie), 0.2)
    unread = {} if vanes else {name: np.full(len(record), np.nan) for name in ANGLES}
    record = replace(record, columns={**record.columns, **unread})
    [whole] = completed_flights(belief, GapFlight(record, RATE, RATE, RATE, source=f"flight {seed}"))
    return whole


def told(effect: str, vanes: bool) -> dict[str, Any]:
    """gap.json of one effect, what is needed of it."""
    aircraft, seed = load_aircraft(AIRCRAFT), sum(map(ord, effect))
    belief = believed(aircraft, np.random.default_rng(seed))
    spec = f"{effect}:{EXAMPLES[effect]}"
    try:
        flights = [fly(aircraft, belief, [spec], plan, seed + k, vanes) for k, plan in enumerate(PLANS)]
    except InputError:  # so large that these manoeuvres cannot be flown
        return {"verdict": "the flight diverges"}
    try:
        found = document(diagnose(belief, flights[:1], flights[1:]))
    except InputError as error:
        return {"verdict": f"refused: {str(error).partition(': ')[2]}"}
    return {"verdict": found["verdict"], "causes": found["causes"], "gap": found["gap"]}


def row(effect: str, found: Mapping[str, Any]) -> list[str]:
    """Of the table."""
    if "gap" not in found:
        return [f"`{effect}:{EXAMPLES[effect]}`", found["verdict"], "-", "-", "-"]
    gap = found["gap"]
    sizes = " → ".join(f"{100.0 * gap[k]:.1f}" for k in ("before", "tolerances", "after"))
    causes = "; ".join(_cause(cause, EXAMPLES[effect]) for cause in found["causes"]) or "-"
    mark = "**" if right(effect, found) else ""
    return [
        f"`{effect}:{EXAMPLES[effect]}`",
        found["verdict"],
        f"{mark}{causes}{mark}",
        sizes,
        f"{100 * gap['noise_floor']:.1f}",
    ]


def right(effect: str, found: Mapping[str, Any]) -> bool:
    """Whether the effect is named first, or beside the first."""
    first = found.get("causes", [])[:1]
    return any(effect in (cause["effect"], *cause["indistinguishable_from"][:2]) for cause in first)


def _cause(cause: Mapping[str, Any], flown: str) -> str:
    """Name, probability, what it was not told apart from, and the parameters that were flown."""
    keys = [part.partition("=")[0] for part in flown.split(":")]
    every = not set(keys) & set(cause["parameters"])  # what was flown on all controls is found on each
    sizes = [f"{k} {v:.3g} ({e:.2g})" for k, (v, e) in cause["parameters"].items() if every or k in keys]
    rivals = f" or {', '.join(cause['indistinguishable_from'])}" if cause["indistinguishable_from"] else ""
    return f"{cause['label']}{rivals} {cause['probability']:.2f}{': ' if sizes else ''}{', '.join(sizes)}"


def section(out: Path, vanes: bool) -> str:
    """The table, effects that are not finished yet flown and diagnosed."""
    rows, named = [], 0
    for effect in SHOWN:
        kept = out / f"{effect}{'' if vanes else '_without_vanes'}.json"
        if not kept.exists():
            kept.write_text(json.dumps(told(effect, vanes)), encoding="utf-8")
        found = json.loads(kept.read_text(encoding="utf-8"))
        rows.append(row(effect, found))
        named += right(effect, found)
    heads = ("flown", "verdict", "named, probability: size (s.e.)", "gap %: file → tolerances → after", "floor")
    flown = sum(row[1] != "the flight diverges" for row in rows)
    return f"{table(heads, rows)}\n\nNamed first, or beside the first: {named} of {flown} that could be flown."


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/gap_effects"), help="folder of finished effects")
    parser.add_argument("--without-vanes", action="store_true")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    name = f"bench/gap/effects.py{' --without-vanes' if args.without_vanes else ''}"
    publish(name, section(args.out, vanes=not args.without_vanes), args.page)


if __name__ == "__main__":
    main()
