"""A fleet that is really flown: simulated flights as bags, through `sysid fleet`, against a sealed truth.

    python -m bench.fleet.flown fly out/flown --seed 1
    sysid fleet out/flown/catalogue.csv --out out/flown/fleet
    python -m bench.fleet.flown judge out/flown

Tails differ from the aircraft file in all derivatives by 4 % (1 sigma), and their true roll damping by another 10 %
that all share, which the file lacks. In the middle of the year one tail loses a quarter of its aileron power. Each
flight lasts 25 s, in turbulence that is drawn. Flights that are there are not flown again. The truth lies in
`sealed.json`, which only `judge` reads.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.bag.writer import write_streams
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie
from sysid_node.sim.simulator import Simulator

RATE, SECONDS = 200.0, 25.0
LACKING, LACK, WEAK, LOSS = "Cl_p", 0.10, "Cl_da", -0.25  # shares of the file's values
START = datetime.datetime(2026, 1, 1, 10, tzinfo=datetime.UTC)
MANOEUVRE = (
    "3211:elevator:amplitude=0.06:width=0.3:start=1:every=6:repeat=4",
    "3211:aileron:amplitude=0.06:width=0.25:start=1.3:every=6:repeat=4",
    "3211:rudder:amplitude=0.12:width=0.3:start=3.5:every=6:repeat=4",
)


def draw(types: list[str], tails: int, flights: int, seed: int) -> dict[str, Any]:
    """The sealed truth: each tail's derivatives, and each flight with its day, turbulence and seed."""
    generator = np.random.default_rng([seed, 240])
    truth: dict[str, Any] = {"tails": {}, "flights": [], "worn": "", "since": 182.0}
    for aircraft in types:
        values = {name: d.value for name, d in load_aircraft(aircraft).derivatives.items()}
        for j in range(tails):
            own = {name: value * (1 + 0.04 * generator.standard_normal()) for name, value in values.items()}
            own[LACKING] += LACK * values[LACKING]
            tail = f"{aircraft}-{j + 1}"
            truth["tails"][tail] = own
            for i in range(flights):
                day = 365 * (i + float(generator.uniform(0.1, 0.9))) / flights
                air = str(generator.choice(["none", "light"]))
                flight = {"tail": tail, "aircraft": aircraft, "day": day, "turbulence": air, "name": f"{tail}_{i:02d}"}
                truth["flights"].append({**flight, "seed": int(generator.integers(2**31))})
    truth["worn"] = str(generator.choice(list(truth["tails"])))
    return truth


def fly(folder: Path, truth: dict[str, Any]) -> None:
    """Fly what is missing, and write the catalogue."""
    simulators = {name: Simulator(load_aircraft(name), RATE) for name in {f["aircraft"] for f in truth["flights"]}}
    (folder / "logs").mkdir(parents=True, exist_ok=True)
    for flight in truth["flights"]:
        path = folder / "logs" / flight["name"]
        if not path.exists():
            _fly_one(simulators[flight["aircraft"]], flight, truth, path)
            print(flight["name"], flush=True)
    write_catalogue(folder, truth["flights"])


def write_catalogue(folder: Path, flights: Sequence[Mapping[str, Any]]) -> None:
    """Write ``catalogue.csv`` for flights with their name, aircraft, tail and day of the year."""
    with (folder / "catalogue.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["path", "aircraft", "tail", "date"])
        for f in flights:
            date = (START + datetime.timedelta(days=f["day"])).isoformat()
            writer.writerow([f"logs/{f['name']}", f["aircraft"], f["tail"], date])


def _fly_one(simulator: Simulator, flight: dict[str, Any], truth: dict[str, Any], path: Path) -> None:
    file = {name: d.value for name, d in simulator.aircraft.derivatives.items()}
    own = true_derivatives(flight, truth, file)
    errors = ":".join(f"{name}={own[name] - value:.9g}" for name, value in file.items())
    conditions = SortieConditions(
        [f"derivative_error:{errors}"], None, flight["turbulence"], 100.0, True, 1.0, flight["seed"], rotary_gusts=True
    )
    manoeuvre = parse_manoeuvre(MANOEUVRE, simulator.aircraft, RATE, SECONDS)
    deflections = np.column_stack([manoeuvre.surfaces(), np.zeros(manoeuvre.time.size)])
    sortie = fly_sortie(simulator, deflections, conditions)
    unfinished = path.with_name(f".{path.name}")
    write_streams(unfinished, FlightSampler(RATE, 100.0, 100.0, surfaces="measured").record(sortie), "mcap", "flu", {})
    unfinished.rename(path)


def true_derivatives(flight: dict[str, Any], truth: dict[str, Any], file: dict[str, float]) -> dict[str, float]:
    """The derivatives of a tail on the day of a flight."""
    own = dict(truth["tails"][flight["tail"]])
    if flight["tail"] == truth["worn"] and flight["day"] >= truth["since"]:
        own[WEAK] += LOSS * file[WEAK]
    return own


def judge(folder: Path) -> Iterator[str]:
    """What the fleet's summary says, against the truth."""
    truth = json.loads((folder / "sealed.json").read_text(encoding="utf-8"))
    summary = json.loads((folder / "fleet" / "fleet.json").read_text(encoding="utf-8"))["summary"]
    drifts = [(d["tail"], d["name"]) for d in summary["drifts"] if d["significant"]]
    yield f"worn: {truth['worn']}, {WEAK}; called: {drifts}"
    means, scatters = [], []
    for p in summary["populations"]:
        file = load_aircraft(p["aircraft"]).derivatives[p["name"]].value
        mean = file * (1 + (LACK if p["name"] == LACKING else 0.0))
        means.append(p["lower"] <= mean <= p["upper"])
        limits = p["scatter_of_tails"]
        if limits["lower"] is not None:
            scatters.append(limits["lower"] <= 0.04 * abs(file) <= limits["upper"])
    yield f"means in their 95 % intervals: {sum(means)} of {len(means)}"
    yield f"scatters of tails in their 95 % intervals: {sum(scatters)} of {len(scatters)}"
    differs = [(d["aircraft"], d["name"]) for d in summary["differences_from_file"] if d["significant"]]
    yield f"the simulator's error is {LACKING}; the type's mean differs from the file in: {differs}"
    yield _levels(summary, truth)


def _levels(summary: dict[str, Any], truth: dict[str, Any]) -> str:
    """Errors of the tails' values, from their own flights and with the fleet."""
    own, level, held = [], [], []
    for p in summary["populations"]:
        for tail in p["by_tail"]:
            value = truth["tails"][tail["tail"]][p["name"]]
            size = abs(value)
            own.append((tail["own"] - value) / size)
            level.append((tail["level"] - value) / size)
            held.append(abs(tail["level"] - value) <= 1.96 * np.hypot(tail["level_error"], tail["systematic"]))
    rms = [100 * float(np.sqrt(np.mean(np.square(errors)))) for errors in (own, level)]
    return (
        f"tails' derivatives: error {rms[0]:.1f} % from their own flights, {rms[1]:.1f} % with the fleet; "
        f"{sum(held)} of {len(held)} in their 95 % intervals"
    )


def main() -> None:
    """Flies or judges."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["fly", "judge"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--types", nargs="+", default=["cdrw"])
    parser.add_argument("--tails", type=int, default=6)
    parser.add_argument("--flights", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    if args.what == "judge":
        print("\n".join(judge(args.folder)))
        return
    truth = draw(args.types, args.tails, args.flights, args.seed)
    args.folder.mkdir(parents=True, exist_ok=True)
    (args.folder / "sealed.json").write_text(json.dumps(truth), encoding="utf-8")
    fly(args.folder, truth)


if __name__ == "__main__":
    main()
