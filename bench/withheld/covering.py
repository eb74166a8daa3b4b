"""Whether the stated interval of the shrinkage covers: `python -m bench.withheld.covering SET SEED FOLDER`.

The shrinkage that the diagnosis states is measured again, by the same rule, on flights of the plant that it has not
seen, in other gusts with other noise. Only for plants and effects that the simulator can fly as they are. Writes
``FOLDER/SEED/covered.json``.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from bench.withheld.closing import effects_of
from bench.withheld.drawing import Case
from bench.withheld.plants.instruments import SUITES, readings, record
from bench.withheld.plants.plant import Plant
from bench.withheld.predicting import everywhere, vector
from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.bag.writer import write_streams
from sysid_node.gap.flightdata.gap_flight import ANALYSIS_RATE, load_gap_flights
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.validation.simulation_error import simulation_gap
from sysid_node.sim import Simulator

#: Numbers of the flights that are flown for this: after the one fitted and the one held out.
_FLIGHTS = (2, 3, 4)


def main(which: str, seed: int, folder: Path) -> None:
    """Flies, compares and writes."""
    case = folder / str(seed)
    label = json.loads((folder / "labels" / f"{seed}.json").read_text(encoding="utf-8"))
    plant = Plant(Case(**{k: v for k, v in label.items() if k in Case.__dataclass_fields__}), which)
    aircraft = load_aircraft(str(case / "aircraft.yaml"))
    simulator = Simulator(aircraft, ANALYSIS_RATE)
    models = tuple(_model(plant, simulator, flight, label["effects"]) for flight in _FLIGHTS)
    found = effects_of((case / "out" / "effects.txt").read_text(encoding="utf-8"))
    after = vector(simulator, load_aircraft(str(case / "out" / "corrected.yaml")), found)
    before, corrected = (everywhere(models, point) for point in (simulator.neutral(), after))
    gap = simulation_gap(before, corrected)
    errors = asdict(gap) if gap else {}
    kept = {name: errors[name] for name in ("before", "after", "noise_floor", "shrink_percent") if errors}
    (case / "covered.json").write_text(json.dumps(kept), encoding="utf-8")


def _model(
    plant: Plant, simulator: Simulator, flight: int, effects: Mapping[str, Mapping[str, float]]
) -> ResidualModel:
    """Another flight of the plant, through its instruments and a bag, as the diagnosis sees flights."""
    case, log = plant.case, plant.fly(effects, flight)
    random = np.random.default_rng([case.seed, flight])
    seen = readings(log, plant.truth, effects)
    streams = record(log, seen, plant.truth, effects, SUITES[case.suite], case.noise, random)
    with tempfile.TemporaryDirectory() as folder:
        write_streams(Path(folder) / "flight", streams)
        [seen] = load_gap_flights(Path(folder) / "flight", simulator.aircraft, None, "flu")
    return residual_model_of(simulator, seen)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
