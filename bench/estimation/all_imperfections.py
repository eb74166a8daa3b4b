"""Coverage of the intervals where everything is a little off at once.

    python -m bench.estimation.all_imperfections RESULTS.jsonl [--flights 60] [--first 1] [--replay | --others]
        [--actuators auto] [--page FILE]

Each flight is that of `sysid simulate --aircraft cdrw --manoeuvre 3211:repeat=3`, with imperfections drawn as aircraft
have them: servos of first order (20 to 120 ms) or second (3 to 12 Hz), rate limits of 2 to 6 rad/s, delays up to 40 ms,
late gyroscopes and air data, and every tolerance of the aircraft file at its size. The estimators have the commands
alone. Of the servos the aircraft file is right, wrong by its tolerances, or silent. A flight's number is the seed of
all that is drawn, so that results can be continued; they are appended line by line. `--page` makes the tables,
`--replay` those of the online estimator alone, and `--others` that of the online estimator on other aircraft and by
multisine, so many flights of each. `--actuators commands` tells the online estimator what is recorded.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.batch.identify import identify
from sysid_node.batch.settings import BatchSettings
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.align import flight_record
from sysid_node.flight.streams import Streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import Sortie, SortieConditions, fly_sortie

MANOEUVRE, RATE, COMMAND_RATE = "3211:repeat=3", 1000.0, 100.0  # Hz, of the simulation and of the autopilot
MULTISINE = "multisine:every=22:repeat=2"
OTHERS = (("cdrw", MULTISINE), ("cdfp", MANOEUVRE), ("cdfp", MULTISINE), ("kestrel", MANOEUVRE), ("kestrel", MULTISINE))
AIRS, ORDERS, FILES = ("none", "light", "moderate"), ("first", "second"), ("right", "wrong", "silent")
METHODS = ("replay", "equation_error")

Effects = dict[str, dict[str, float]]


def drawn(aircraft: Aircraft, number: int) -> tuple[dict[str, str], Effects]:
    """What a flight is like, and its imperfections."""
    random = np.random.default_rng(20_000 + number)
    kind = {"air": AIRS[number % 3], "order": ORDERS[number // 3 % 2], "file": FILES[number // 6 % 3]}
    sigma, names = aircraft.tolerances, tuple(aircraft.controls)
    second = kind["order"] == "second"
    low, high = (1.0 / (2.0 * math.pi * 12.0), 1.0 / (2.0 * math.pi * 3.0)) if second else (0.02, 0.12)
    typical = float(np.exp(random.uniform(math.log(low), math.log(high))))
    lags = {name: typical * float(random.uniform(0.8, 1.25)) for name in names}
    delay = float(random.uniform(0.0, 0.04))

    def normal(effect: str, keys: str, key: str = "", size: float = 1.0) -> dict[str, float]:
        return {k: size * sigma[f"{key or effect}.{k}"] * float(random.normal()) for k in keys.split()}

    inertia = normal("", "Ixx Iyy Izz", "inertia")
    moments = {"Ixx": aircraft.inertia.Ixx, "Iyy": aircraft.inertia.Iyy, "Izz": aircraft.inertia.Izz}
    effects: Effects = {
        "actuator_lag": lags | ({"damping": float(random.uniform(0.6, 0.9))} if second else {}),
        "command_delay": dict.fromkeys(names, delay),
        "actuator_rate_limit": dict.fromkeys(names, float(random.uniform(2.0, 6.0))),
        "imu_delay": {"delay": float(random.uniform(0.0, 0.011))},
        "air_data_delay": {"delay": float(random.uniform(-0.01, 0.01))},
        "actuator_stamp_delay": {"delay": float(random.uniform(-0.01, 0.01))},
        "air_data_lag": {"time_constant": float(random.uniform(0.0, 0.08))},
        "mass_error": {"error": sigma["mass"] / aircraft.mass * float(random.normal())},
        "inertia_error": {k: v / moments[k] for k, v in inertia.items()},
        "imu_scale": normal("imu_scale", "ax ay az p q r"),
        "imu_bias": normal("imu_bias", "ax ay az p q r"),
        "imu_misalignment": normal("imu_misalignment", "roll pitch yaw"),
        "imu_lever_arm": normal("imu_lever_arm", "x y z", "sensors.imu"),
        "vane_lever_arm": normal("vane_lever_arm", "x y z", "sensors.air_data"),
        "vane_scale": normal("vane_scale", "alpha beta"),
        "vane_bias": normal("vane_bias", "alpha beta"),
        "airspeed_scale": normal("airspeed_scale", "error"),
        "cg_shift": normal("cg_shift", "x y z"),
        "actuator_bias": {n: sigma[f"controls.{n}.offset"] * float(random.normal()) for n in names},
        "control_effectiveness_loss": {n: sigma[f"controls.{n}.scale"] * float(random.normal()) for n in names},
        "thrust_scale": {"error": 0.1 * float(random.normal())},
    }
    return kind, effects


def known(aircraft: Aircraft, kind: Mapping[str, str], effects: Effects, number: int) -> Aircraft:
    """The aircraft file: what it says of the servos is right, wrong by its own tolerances, or nothing."""
    if kind["file"] == "silent":
        return aircraft
    random = np.random.default_rng(40_000 + number)
    wrong = kind["file"] == "wrong"
    stated: dict[str, dict[str, UncertainValue]] = {}
    for effect, floor in (("actuator_lag", 0.005), ("command_delay", 0.005), ("actuator_rate_limit", 0.0)):
        stated[effect] = {}
        for key, value in effects[effect].items():
            spread = 0.1 if key == "damping" else max(floor, 0.2 * value)
            said = value + (spread * float(random.normal()) if wrong else 0.0)
            stated[effect][key] = UncertainValue(max(said, 0.001), spread)
    return replace(aircraft, effects=stated)


def fly(simulator: Simulator, effects: Effects, air: str, seed: int, manoeuvre: str = MANOEUVRE) -> Sortie:
    """One flight at the hands of the autopilot."""
    plan = parse_manoeuvre(manoeuvre, simulator.aircraft, RATE)
    moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    return fly_sortie(simulator, moves, SortieConditions(effects, turbulence=air, seed=seed, command_rate=COMMAND_RATE))


def estimated(method: str, aircraft: Aircraft, streams: Streams, carried: str) -> tuple[Mapping[str, Any], ...]:
    """The derivatives and the servos at the end."""
    if method == "replay":
        settings = OnlineSettings(actuators=carried)
        aligned = align_streams(aircraft, streams, settings.max_gap, carried)
        end = aligned.time[-1:]
        final = run(aircraft, settings, aligned.time, aligned.samples, end, commands_from=aligned.commands_from)[-1]
        return final.derivatives, final.servos
    record = flight_record(aircraft, streams, 0.2, carried)
    fit = identify(method, aircraft, [record], BatchSettings(actuators=carried)).fit
    return fit.estimates, fit.systematic.servos


def flown(
    simulator: Simulator,
    aircraft: Aircraft,
    number: int,
    methods: Sequence[str] = METHODS,
    manoeuvre: str = MANOEUVRE,
    carried: str = "auto",
) -> dict[str, Any]:
    """One line of the results: of each method the rows of derivatives and servos, and how many were valid without."""
    kind, effects = drawn(aircraft, number)
    sortie = fly(simulator, effects, kind["air"], number, manoeuvre)
    streams, file = FlightSampler().record(sortie), known(aircraft, kind, effects, number)
    truth, line = sortie.derivatives, {"number": number, **kind, "effects": effects}
    damping = effects["actuator_lag"].get("damping")
    late = {
        name: effects["command_delay"][name] + effects["actuator_lag"][name] * (2.0 * damping if damping else 1.0)
        for name in aircraft.controls
    }
    for method in methods:
        derivatives, servos = estimated(method, file, streams, carried)
        line[method] = {name: _row(d, truth[name]) for name, d in derivatives.items()}
        line[f"{method}_servos"] = {name: _row(d, late[name]) for name, d in servos.items()}
    exact = FlightSampler(actuator_rate=200.0, surfaces="measured").record(
        fly(simulator, {}, kind["air"], number, manoeuvre)
    )
    ideal = replace(aircraft, ideal=True, noise_bias=dict.fromkeys(aircraft.noise_bias, 0.0))
    line["valid_exact"] = sum(d.valid for d in estimated("replay", ideal, exact, "positions")[0].values())
    return line


def _row(estimate: Any, truth: float) -> list[float]:
    parts = (estimate.value, estimate.standard_error, estimate.lower, estimate.upper, estimate.valid, truth)
    return [float(f"{float(x):.6g}") if math.isfinite(float(x)) else 1e9 for x in parts]


def groups(lines: list[dict[str, Any]]) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """All flights, and those of each air, order of the servos, and knowledge of them."""
    yield "all", lines
    for key, values in (("air", AIRS), ("order", ORDERS), ("file", FILES)):
        words = {"air": "air: {}", "order": "servos of {} order", "file": "the file on servos: {}"}[key]
        for value in values:
            if chosen := [line for line in lines if line[key] == value]:
                yield words.format("still" if value == "none" else value), chosen


def counted(lines: list[dict[str, Any]], rows: str) -> list[str]:
    """Valid a flight, share of these that hold, and that are more than four standard errors off."""
    valid = [row for line in lines for row in line[rows].values() if row[4]]
    if not valid:
        return ["0", "-", "-"]
    hold = sum(low <= truth <= high for _, _, low, high, _, truth in valid)
    far = sum(abs(value - truth) > 4.0 * error for value, error, _, _, _, truth in valid)
    shares = f"{100.0 * hold / len(valid):.1f} %", f"{100.0 * far / len(valid):.2f} %"
    return [f"{len(valid) / len(lines):.1f}", *shares]


def tables(lines: list[dict[str, Any]], methods: Sequence[str] = METHODS) -> str:
    """The methods by group, then each derivative."""
    counts = ("valid", "hold", "> 4 s.e.")
    heads = ("flights", "number", "valid, exact", *(f"{m}: {c}" for m in (*methods, "servos") for c in counts))
    body = [
        [
            name,
            str(len(some)),
            f"{np.mean([line['valid_exact'] for line in some]):.1f}",
            *(cell for method in methods for cell in counted(some, method)),
            *counted(some, "replay_servos"),
        ]
        for name, some in groups(lines)
    ]
    each = []
    for name in lines[0]["replay"]:
        row = [f"`{name}`"]
        for method in methods:
            rows = [line[method][name] for line in lines if line[method][name][4]]
            scores = [(r[0] - r[5]) / r[1] for r in rows]
            held = sum(r[2] <= r[5] <= r[3] for r in rows)
            row += [str(len(rows)), f"{held / len(rows):.0%}" if rows else "-"]
            row += [f"{np.mean(scores):+.2f}" if rows else "-", f"{np.std(scores):.2f}" if rows else "-"]
        each.append(row)
    columns = ("valid in flights", "hold", "mean error / s.e.", "scatter / s.e.")
    second = ("derivative", *(f"{m}: {c}" for m in methods for c in columns))
    return f"{table(heads, body)}\n\n{table(second, each)}"


def others(path: Path, first: int, flights: int, carried: str) -> str:
    """The table of so many flights of each of the others, from the first number on, no number twice.

    Those that are missing in a file of results are flown, and what their actuators topic is said to carry is kept.
    """
    kept, rows = _read(path), []
    lines = {(line["aircraft"], line["manoeuvre"], line["carried"], line["number"]): line for line in kept}
    for place, (name, manoeuvre) in enumerate(OTHERS):
        keys = [(name, manoeuvre, carried, first + place * flights + k) for k in range(flights)]
        aircraft = load_aircraft(name)
        simulator = Simulator(aircraft, RATE)
        for key in keys:
            if key not in lines:
                line = flown(simulator, aircraft, key[-1], METHODS[:1], manoeuvre, carried)
                lines[key] = {"aircraft": name, "manoeuvre": manoeuvre, "carried": carried, **line}
                _append(path, lines[key])
        some = [lines[key] for key in keys]
        exact = f"{np.mean([line['valid_exact'] for line in some]):.1f}"
        words = f"`{name}`, {manoeuvre.split(':')[0].replace('3211', '3-2-1-1')}"
        rows.append([words, str(len(some)), exact, *counted(some, "replay"), *counted(some, "replay_servos")])
    counts = ("valid", "hold", "> 4 s.e.")
    heads = ("flights", "number", "valid, exact", *counts, *(f"servos: {c}" for c in counts))
    return table(heads, rows)


def _append(path: Path, line: Mapping[str, Any]) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def _read(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


def main() -> None:
    """Fly what is missing, and make the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path, help="file of JSON lines: read, and continued")
    parser.add_argument("--flights", type=int, default=60, help="how many flights (default: 60)")
    parser.add_argument("--first", type=int, default=1, help="number of the first flight (default: 1)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--replay", action="store_true", help="the online estimator alone")
    which.add_argument("--others", action="store_true", help="other aircraft and manoeuvres")
    parser.add_argument("--actuators", choices=("auto", "commands"), default="auto", help="what they are said to carry")
    args = parser.parse_args()
    numbers = range(args.first, args.first + args.flights)
    if args.others:
        found = others(args.results, args.first, args.flights, args.actuators)
        publish("bench/estimation/all_imperfections.py others", found, args.page)
        return
    lines, methods = _read(args.results), METHODS[:1] if args.replay else METHODS
    aircraft = load_aircraft("cdrw")
    simulator = Simulator(aircraft, RATE)
    for number in numbers:
        if all(line["number"] != number for line in lines):
            lines.append(flown(simulator, aircraft, number, methods, carried=args.actuators))
            _append(args.results, lines[-1])
    section = f"bench/estimation/all_imperfections.py{' replay' if args.replay else ''}"
    publish(section, tables(lines, methods), args.page)


if __name__ == "__main__":
    main()
