"""What the diagnosis says of a simulator that it knows from its own flights: `python -m bench.gap.simulated`

    python -m bench.gap.simulated [--most N] [--page docs/results/gap_simulated.md]

The simulator is a plant of the scoreboard (`bench/withheld/plants`), which shares no code with the package's own: rigid
bodies with servos of second order, or JSBSim's c172p. It has servos of 40 ms, a slow motor and an elevator that loses
effect at large deflections, of which the aircraft file says nothing; the file's derivatives are off by draws from their
tolerances. Two flights of it without noise are given as `--simulated`. Reality is the same plant with an effect that is
withheld, or with none: one flight with the noise of real sensors, in still air. Effects, sizes and seeds were chosen
before the first run. Finished cases are kept in `--out`, so that the command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.pages import publish, table
from bench.withheld.drawing import SETS, draw, programme_of
from bench.withheld.plants.instruments import SUITES, readings, record
from bench.withheld.plants.plant import Plant, believed
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.align import flight_record
from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.document import document
from sysid_node.gap.flightdata.gap_flight import GapFlight, completed_flights

Effects = Mapping[str, Mapping[str, float]]

#: What every simulator has beyond its aircraft file. The JSBSim plant has its own engine and tables besides.
HIDDEN: Effects = {
    "actuator_lag": {"time_constant": 0.04},
    "motor_lag": {"time_constant": 0.3},
    "control_nonlinearity": {"elevator": 12.0},
}
_RIGID = ("motor_lag",)  # not of the JSBSim plant

#: Flights: of reality the first, of the simulator the second and third, with other manoeuvres.
_REAL, _SIMULATED = 0, (1, 2)


@dataclass(frozen=True)
class Case:
    """A simulator, and what reality has beyond it."""

    plant: str
    effects: Effects = field(default_factory=dict)
    listed: bool = True


CASES = (
    Case("cdrw"),
    Case("cdrw", {"actuator_lag": {"elevator": 0.118}}),
    Case("c172p"),
    Case("c172p", {"actuator_lag": {"elevator": 0.118}}),
    Case("kestrel", {"command_delay": {"delay": 0.06}}),
    Case("c172p", {"mass_error": {"error": 0.2}}),
    Case("cdrw", {"thrust_scale": {"error": -0.3}}),
    Case("kestrel"),
    Case("c172p", {"imu_bias": {"q": 0.03}}),
    Case("cdrw", {"saturation": {"q": 0.35}}, listed=False),
    Case("kestrel", {"control_effectiveness_loss": {"aileron": 0.5, "onset": 20.0}}),
    Case("c172p", {"air_data_lag": {"time_constant": 0.12}}),
    Case("cdrw", {"derivative_error": {"Cm_alpha": 6.0}}),
    Case("kestrel", {"imu_delay": {"delay": 0.05}}),
    Case("c172p", {"derivative_error": {"Cn_beta": 6.0}}),
    Case("cdrw", {"vane_scale": {"alpha": 0.3}}),
    Case("kestrel", {"inertia_error": {"Iyy": 0.45}}),
    Case("c172p", {"ice": {"lift_loss": 0.3, "drag": 0.02, "seconds": 40.0}}, listed=False),
    Case("cdrw", {"cg_shift": {"x": 0.015}}),
    Case("kestrel", {"actuator_rate_limit": {"rate": 0.5}}),
)


def told(case: Case, number: int) -> dict[str, Any]:
    """What gap.json says of one case, and the processor time that it took, s."""
    seed = 700 + number
    random = np.random.default_rng([SETS["development"], seed])
    drawn = draw("development", seed)
    manoeuvres = tuple(programme_of("steps", case.plant, random) for _ in range(2))
    plant = Plant(
        replace(drawn, plant=case.plant, effects=dict(case.effects), manoeuvres=manoeuvres, turbulence="none"),
        "development",
    )
    file = believed(plant.truth, random)
    own = {name: v for name, v in HIDDEN.items() if case.plant != "c172p" or name not in _RIGID}
    real = {name: {**own.get(name, {}), **plant.effects.get(name, {})} for name in {**own, **plant.effects}}
    flight = _flown(plant, file, real, _REAL, 1.0, random)
    simulated = [_flown(plant, file, own, k, 0.0, random) for k in _SIMULATED]
    began = time.process_time()
    content = document(diagnose(file, [flight], [], simulated=simulated))
    kept = {key: content[key] for key in ("verdict", "causes", "gap", "surrogate")}
    return {**kept, "processor_s": time.process_time() - began}


def _flown(
    plant: Plant, file: Aircraft, effects: Effects, flight: int, noise: float, random: np.random.Generator
) -> GapFlight:
    """One flight as a bag would hold it, read with the file."""
    log = plant.fly(effects, flight)
    suite = SUITES["research"]
    streams = record(log, readings(log, plant.truth, effects), plant.truth, effects, suite, noise, random)
    flown = flight_record(file, streams, 0.2)
    source = f"{plant.case.plant} {flight}"
    [whole] = completed_flights(file, GapFlight(flown, suite.imu, suite.air, suite.actuators, source=source))
    return whole


def right(case: Case, found: Mapping[str, Any]) -> bool:
    """Whether the verdict is that of the case: no gap, the effect first or beside the first, or unknown."""
    if not case.effects:
        return bool(found["verdict"] == "no_gap")
    if not case.listed:
        return bool(found["verdict"] == "unknown_effect")
    first = found["causes"][:1]
    return any(set(case.effects) & {cause["effect"], *cause["indistinguishable_from"][:2]} for cause in first)


def row(case: Case, found: Mapping[str, Any]) -> list[str]:
    """Of the table."""
    gap = found["gap"]
    mark = "**" if right(case, found) else ""
    causes = "; ".join(_cause(cause, case) for cause in found["causes"]) or "-"
    sizes = " → ".join(f"{100.0 * gap[key]:.1f}" for key in ("before", "after"))
    beyond = [f"`{name}`" for name in found["surrogate"]["effects"]]
    known = ", ".join([*beyond, *(f"{text}" for text in found["surrogate"]["tables"])]) or "-"
    return [
        f"{case.plant}: {_flown_words(case)}",
        f"{mark}{found['verdict']}{mark}",
        causes,
        sizes,
        f"{100.0 * gap['noise_floor']:.1f}",
        f"{100.0 * found['surrogate']['error']:.1f}",
        known,
        f"{found['processor_s']:.0f}",
    ]


def _flown_words(case: Case) -> str:
    return "; ".join(
        f"`{name}:{':'.join(f'{key}={value:g}' for key, value in values.items())}`"
        for name, values in case.effects.items()
    ) or "the same"  # fmt: skip


def _cause(cause: Mapping[str, Any], case: Case) -> str:
    """Name, probability, alternatives, and the sizes with their standard errors of what was flown."""
    flown = case.effects.get(cause["effect"], {})
    sizes = [f"{k} {v:.3g} ({e:.2g})" for k, (v, e) in cause["parameters"].items() if k in flown or not flown]
    rivals = f" or {', '.join(cause['indistinguishable_from'])}" if cause["indistinguishable_from"] else ""
    return f"{cause['label']}{rivals} {cause['probability']:.2f}: {', '.join(sizes[:4])}"


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/gap_simulated"), help="folder of finished cases")
    parser.add_argument("--most", type=int, default=len(CASES), help="cases to run, from the first on")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    rows, correct = [], 0
    for number, case in enumerate(CASES[: args.most]):
        kept = args.out / f"{number}.json"
        if not kept.exists():
            kept.write_text(json.dumps(told(case, number)), encoding="utf-8")
        found = json.loads(kept.read_text(encoding="utf-8"))
        rows.append(row(case, found))
        correct += right(case, found)
    heads = ("simulator: withheld from it", "verdict", "causes, probability: size (s.e.)", "gap %: before → after",
             "floor", "surrogate's error %", "found in the simulator", "processor s")  # fmt: skip
    text = f"{table(heads, rows)}\n\nRight: {correct} of {len(rows)}, of {len(CASES)} cases that are drawn up."
    publish("bench/gap/simulated.py", text, args.page)


if __name__ == "__main__":
    main()
