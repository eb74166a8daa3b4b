"""A small fleet that is flown and diagnosed, through `sysid fleet --gap`, against a sealed truth.

    python -m bench.fleet.diagnosed fly out/diagnosed/1 --seed 1
    sysid fleet out/diagnosed/1/catalogue.csv --gap --out out/diagnosed/1/fleet
    python -m bench.fleet.diagnosed judge out/diagnosed/1 [more folders]

Three tails of each type, three flights each over a year, in still air or light turbulence. Tails differ from the file
by 4 % (1 sigma) in all derivatives. All tails of a type have one effect that the file lacks, drawn from `SHARED`; its
size is drawn within 20 % of the size that its picture in docs/reference/effects.md has. One tail's elevator servo is
slow from its first flight on. Commands are recorded, not deflections. The truth lies in `sealed.json`, which only
`judge` reads.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.fleet.flown import write_catalogue
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.bag.writer import write_streams
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie
from sysid_node.sim.pages.effects_page import EXAMPLES
from sysid_node.sim.simulator import Simulator

RATE, SECONDS, TAILS = 100.0, 44.0, 3
SHARED = ("drag_rise", "motor_lag", "thrust_line_offset", "thrust_yaw")
SLOW, SLOWEST = 0.08, 0.14  # s, time constant of the slow servo
THROTTLE = "doublet:throttle:amplitude=0.3:width=2:start=38"
PLANS = (("3211:width=0.4:repeat=2", THROTTLE), ("multisine:length=34:low=0.1:high=2", THROTTLE))


def draw(seed: int, types: Sequence[str], flights: int) -> dict[str, Any]:
    """The sealed truth: of each type the shared effect, the slow tail and the tails' derivatives; and each flight."""
    truth: dict[str, Any] = {"types": {}, "flights": []}
    for k, aircraft in enumerate(types):
        generator = np.random.default_rng([seed, 241, k])
        truth["types"][aircraft] = of_type = _draw_type(generator, aircraft)
        for tail in of_type["tails"]:
            for i in range(flights):
                day = 365 * (i + float(generator.uniform(0.1, 0.9))) / flights
                air, plan = str(generator.choice(["none", "light"])), int(generator.integers(2))
                flight = {"tail": tail, "aircraft": aircraft, "day": day, "turbulence": air, "plan": plan}
                name, noise = f"{tail}_{i:02d}", int(generator.integers(2**31))
                truth["flights"].append({**flight, "seed": noise, "name": name})
    return truth


def _draw_type(generator: np.random.Generator, aircraft: str) -> dict[str, Any]:
    effect = str(generator.choice(SHARED))
    parts = [part.partition("=") for part in EXAMPLES[effect].split(":")]
    factor = float(generator.uniform(0.8, 1.2))
    values = {name: d.value for name, d in load_aircraft(aircraft).derivatives.items()}
    tails = {
        f"{aircraft}-{j + 1}": {name: value * 0.04 * generator.standard_normal() for name, value in values.items()}
        for j in range(TAILS)
    }
    return {
        "effect": effect,
        "size": {key: factor * float(value) for key, _, value in parts},
        "slow": str(generator.choice(list(tails))),
        "lag": float(generator.uniform(SLOW, SLOWEST)),
        "tails": tails,
    }


def fly(folder: Path, truth: Mapping[str, Any]) -> None:
    """Fly what is missing, and write the catalogue."""
    simulators = {name: Simulator(load_aircraft(name), RATE) for name in truth["types"]}
    (folder / "logs").mkdir(parents=True, exist_ok=True)
    for flight in truth["flights"]:
        path = folder / "logs" / flight["name"]
        if not path.exists():
            _fly_one(simulators[flight["aircraft"]], flight, truth["types"][flight["aircraft"]], path)
    write_catalogue(folder, truth["flights"])


def _fly_one(simulator: Simulator, flight: Mapping[str, Any], truth: Mapping[str, Any], path: Path) -> None:
    effects = {"derivative_error": truth["tails"][flight["tail"]], truth["effect"]: truth["size"]}
    if flight["tail"] == truth["slow"]:
        effects["actuator_lag"] = {"elevator": truth["lag"]}
    specs = [f"{name}:" + ":".join(f"{key}={v:.9g}" for key, v in keys.items()) for name, keys in effects.items()]
    planned = parse_manoeuvre(PLANS[flight["plan"]], simulator.aircraft, RATE, SECONDS).deflections
    deflections = np.zeros((round(SECONDS * RATE) + 1, len(simulator.commands)))
    for column, name in enumerate(planned):
        deflections[:, column] = planned[name]
    throttle = simulator.aircraft.throttle
    assert throttle is not None
    deflections[:, -1] *= throttle.max_thrust or 1.0
    conditions = SortieConditions(specs, turbulence=flight["turbulence"], seed=flight["seed"])
    sortie = fly_sortie(simulator, deflections, conditions)
    unfinished = path.with_name(f".{path.name}")
    write_streams(unfinished, FlightSampler(RATE, RATE, RATE).record(sortie), "mcap", "flu", {})
    unfinished.rename(path)


def judged(folder: Path) -> tuple[list[list[str]], list[str]]:
    """A row of the table for each type of a fleet, and lines with every cause that the summary lists."""
    truth = json.loads((folder / "sealed.json").read_text(encoding="utf-8"))
    content = json.loads((folder / "fleet" / "fleet.json").read_text(encoding="utf-8"))
    causes = content["summary"]["causes"]
    rows = [
        _row(aircraft, of_type, [cause for cause in causes if cause["aircraft"] == aircraft])
        for aircraft, of_type in truth["types"].items()
    ]
    verdicts = Counter(str(flight["verdict"]) for flight in content["flights"])
    return rows, [f"{folder}: {dict(verdicts)}", *_listed(causes)]


def _row(aircraft: str, truth: Mapping[str, Any], causes: Sequence[Mapping[str, Any]]) -> list[str]:
    shared = {cause["label"]: cause for cause in causes if cause["shared"] >= 0.5}
    own = {(t["tail"], cause["label"]): t for cause in causes for t in cause["tails"] if t["own"] >= 0.5}
    right = (truth["slow"], "actuator_lag of elevator")
    return [
        aircraft,
        f"`{truth['effect']}` ({_flown(truth['size'])})",
        ", ".join(f"`{label}` {c['shared']:.2f} ({_sizes(c['sizes'])})" for label, c in shared.items()) or "none",
        f"{truth['slow']} ({truth['lag']:.3f} s)",
        ", ".join(f"{tail}: `{label}` {t['own']:.2f} ({_sizes(t['sizes'])})" for (tail, label), t in own.items())
        or "none",
        "yes" if set(shared) == {truth["effect"]} and set(own) == {right} else "no",
    ]


def _flown(size: Mapping[str, float]) -> str:
    return ", ".join(f"{key} {value:.3g}" for key, value in size.items())


def _sizes(sizes: Mapping[str, Mapping[str, float]]) -> str:
    return ", ".join(f"{key} {s['value']:.3g}, {s['lower']:.3g} to {s['upper']:.3g}" for key, s in sizes.items())


def _listed(causes: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for cause in causes:
        tails = "; ".join(
            f"{t['tail']} own {t['own']:.2f}, {t['found']} of {t['flights']} flights" for t in cause["tails"]
        )
        yield f"  {cause['label']}: shared {cause['shared']:.3f}; {tails}"


def main() -> None:
    """Flies or judges."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["fly", "judge"])
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--types", nargs="+", default=["kestrel", "cdrw"])
    parser.add_argument("--flights", type=int, default=3, help="flights of each tail")
    args = parser.parse_args()
    if args.what == "fly":
        truth = draw(args.seed, args.types, args.flights)
        args.folders[0].mkdir(parents=True, exist_ok=True)
        (args.folders[0] / "sealed.json").write_text(json.dumps(truth), encoding="utf-8")
        fly(args.folders[0], truth)
        return
    found = [judged(folder) for folder in args.folders]
    print("\n".join(line for _, lines in found for line in lines))
    heads = (
        "type", "all tails have", "put to the simulator", "slow elevator", "put to a tail", "both, and nothing else",
    )  # fmt: skip
    publish("bench/fleet/diagnosed.py", table(heads, [row for rows, _ in found for row in rows]), args.page)


if __name__ == "__main__":
    main()
