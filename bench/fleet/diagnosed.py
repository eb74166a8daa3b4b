"""A small fleet that is flown and diagnosed, through `sysid fleet --gap`, against a sealed truth.

    python -m bench.fleet.diagnosed fly out/diagnosed/1 --seed 1
    sysid fleet out/diagnosed/1/catalogue.csv --gap --out out/diagnosed/1/fleet
    python -m bench.fleet.diagnosed judge out/diagnosed/1 [more folders]

Three tails of the file kestrel, four flights each over a year, in still air or light turbulence. Tails differ from the
file by 4 % (1 sigma) in all derivatives. All have one effect that the file lacks, drawn from `SHARED`; its size is
drawn within 20 % of the size that its picture in docs/reference/effects.md has. One tail's elevator servo is slow from
its first flight on. Commands are recorded, not deflections. The truth lies in `sealed.json`, which only `judge` reads.
"""

from __future__ import annotations

import argparse
import json
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

AIRCRAFT, RATE, SECONDS, TAILS, FLIGHTS = "kestrel", 100.0, 44.0, 3, 4
SHARED = ("nonlinear_pitching_moment", "drag_rise", "motor_lag", "thrust_line_offset", "thrust_yaw")
SLOW, SLOWEST = 0.08, 0.14  # s, time constant of the slow servo
THROTTLE = "doublet:throttle:amplitude=0.3:width=2:start=38"
PLANS = (("3211:width=0.4:repeat=2", THROTTLE), ("multisine:length=34:low=0.1:high=2", THROTTLE))


def draw(seed: int) -> dict[str, Any]:
    """The sealed truth: the shared effect, the slow tail, the tails' derivatives, and each flight."""
    generator = np.random.default_rng([seed, 241])
    effect = str(generator.choice(SHARED))
    parts = [part.partition("=") for part in EXAMPLES[effect].split(":")]
    factor = float(generator.uniform(0.8, 1.2))
    size = {key: factor * float(value) for key, _, value in parts}
    values = {name: d.value for name, d in load_aircraft(AIRCRAFT).derivatives.items()}
    tails = {
        f"{AIRCRAFT}-{j + 1}": {name: value * 0.04 * generator.standard_normal() for name, value in values.items()}
        for j in range(TAILS)
    }
    flights = [
        {
            "tail": tail,
            "aircraft": AIRCRAFT,
            "day": 365 * (i + float(generator.uniform(0.1, 0.9))) / FLIGHTS,
            "turbulence": str(generator.choice(["none", "light"])),
            "plan": int(generator.integers(2)),
            "seed": int(generator.integers(2**31)),
            "name": f"{tail}_{i:02d}",
        }
        for tail in tails
        for i in range(FLIGHTS)
    ]
    slow, lag = str(generator.choice(list(tails))), float(generator.uniform(SLOW, SLOWEST))
    return {"effect": effect, "size": size, "slow": slow, "lag": lag, "tails": tails, "flights": flights}


def fly(folder: Path, truth: Mapping[str, Any]) -> None:
    """Fly what is missing, and write the catalogue."""
    simulator = Simulator(load_aircraft(AIRCRAFT), RATE)
    (folder / "logs").mkdir(parents=True, exist_ok=True)
    for flight in truth["flights"]:
        path = folder / "logs" / flight["name"]
        if not path.exists():
            _fly_one(simulator, flight, truth, path)
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


def judged(folder: Path) -> tuple[list[str], list[str]]:
    """A row of the table for a fleet, and lines with every cause that the summary lists."""
    truth = json.loads((folder / "sealed.json").read_text(encoding="utf-8"))
    content = json.loads((folder / "fleet" / "fleet.json").read_text(encoding="utf-8"))
    causes = content["summary"]["causes"]
    shared = {cause["label"]: cause for cause in causes if cause["shared"] >= 0.5}
    own = {(t["tail"], cause["label"]): t for cause in causes for t in cause["tails"] if t["own"] >= 0.5}
    slow = f"{truth['slow']}: actuator_lag of elevator", ("elevator", truth["lag"])
    right = (truth["slow"], "actuator_lag of elevator")
    named = sum(flight["verdict"] is not None for flight in content["flights"])
    row = [
        f"`{truth['effect']}` ({_flown(truth['size'])})",
        ", ".join(f"{label} {c['shared']:.2f} ({_sizes(c['sizes'])})" for label, c in shared.items()) or "none",
        f"{slow[0]} ({slow[1][0]} {slow[1][1]:.3g})",
        ", ".join(f"{tail}: {label} {t['own']:.2f} ({_sizes(t['sizes'])})" for (tail, label), t in own.items())
        or "none",
        "yes" if set(shared) == {truth["effect"]} and set(own) == {right} else "no",
    ]
    return row, [f"{folder}: {named} diagnoses", *_listed(causes)]


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
    args = parser.parse_args()
    if args.what == "fly":
        truth = draw(args.seed)
        args.folders[0].mkdir(parents=True, exist_ok=True)
        (args.folders[0] / "sealed.json").write_text(json.dumps(truth), encoding="utf-8")
        fly(args.folders[0], truth)
        return
    found = [judged(folder) for folder in args.folders]
    print("\n".join(line for _, lines in found for line in lines))
    heads = ("all tails have", "put to the simulator", "one tail has", "put to a tail", "both, and nothing else")
    publish("bench/fleet/diagnosed.py", table(heads, [row for row, _ in found]), args.page)


if __name__ == "__main__":
    main()
