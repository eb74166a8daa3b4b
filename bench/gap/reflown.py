"""How far a correction closes the gap in the user's own JSBSim: `python -m bench.gap.reflown LEDGER [--cases N]`

The user's simulator is a plain JSBSim model, imported; reality is the same model with an effect that is withheld. Each
case flies two flights, is diagnosed with ``--simulator``, and is added to the ledger; started again, the bench goes on
with the next case. ``--page FILE`` puts the table into a page. Beside what the correction closes in JSBSim stands what
the true effect closes there.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.pages import publish, table
from bench.withheld.jsbsim.flights import write_flights
from bench.withheld.jsbsim.reality import Withheld, edited
from bench.withheld.plants.motion import DivergedError
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.api.flight_file import load
from sysid_node.api.gap_diagnosis import GapDiagnosis, diagnose
from sysid_node.gap.validation.reflown import reflown
from sysid_node.sim.correcting.jsbsim_flight import JsbsimFlyer
from sysid_node.sim.correcting.user_simulator import UserSimulator, user_simulator
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.importing.jsbsim.read import read_jsbsim

#: Aircraft: the airspeed (m/s) at which it is imported. ``kestrel`` is this package's, exported as a JSBSim model.
AIRCRAFT = {"kestrel": 16.0, "c172p": 52.0}

#: Servos that the exported model has, s.
_SERVO = 0.03


def _both(name: str, **values: float | str) -> dict[str, Withheld]:
    return {plane: {name: values} for plane in AIRCRAFT}


#: Withheld effects by name: of each aircraft, what the diagnosis calls it, and its true size there.
EFFECTS: Mapping[str, tuple[Mapping[str, Withheld], str, Mapping[str, float]]] = {
    "servo of the elevator": (
        {"kestrel": _both("servo", control="elevator", lag=0.09)["kestrel"],
         "c172p": _both("servo", control="elevator", lag=0.12)["c172p"]},
        "actuator_lag of elevator", {"kestrel": 0.12, "c172p": 0.12}),
    "effect of the aileron": (
        _both("servo", control="aileron", lost=0.35), "control_effectiveness_loss of aileron",
        dict.fromkeys(AIRCRAFT, 0.35)),
    "Cm_alpha": (
        {"kestrel": {"coefficient": {"Cm_alpha": 0.25}}, "c172p": {"coefficient": {"Cm_alpha": 0.5}}},
        "derivative_error of Cm", {"kestrel": 0.25, "c172p": 0.5}),
    "centre of gravity": (
        {"kestrel": {"cg": {"forward": 0.015}}, "c172p": {"cg": {"forward": 0.1}}}, "cg_shift",
        {"kestrel": 0.015, "c172p": 0.1}),
    "mass": (_both("mass", share=0.2), "mass_error", dict.fromkeys(AIRCRAFT, 0.2)),
    "drag": (_both("coefficient", CD_0=0.02), "derivative_error of CD", dict.fromkeys(AIRCRAFT, 0.02)),
    "none": ({plane: {} for plane in AIRCRAFT}, "", {}),
}  # fmt: skip


def main() -> None:
    """Run cases, or put the table in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ledger", type=Path, help="a line of JSON a case")
    parser.add_argument("--cases", type=int, default=0, help="cases to have in the ledger")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    done = _read(args.ledger)
    for number in range(args.cases):
        if number not in done:
            done[number] = _case(number)
            with args.ledger.open("a") as file:
                file.write(json.dumps(done[number]) + "\n")
            print(done[number], flush=True)
    heads = ("aircraft", "withheld", "air", "verdict", "cause", "named", "size", "closed", "of what the true closes")
    publish("bench.gap.reflown", table(heads, [_row(case) for _, case in sorted(done.items())]), args.page)


def _read(ledger: Path) -> dict[int, dict[str, Any]]:
    lines = ledger.read_text().splitlines() if ledger.exists() else []
    return {case["number"]: case for case in map(json.loads, lines)}


def drawn(number: int) -> tuple[str, str, str]:
    """Aircraft, withheld effect and turbulence of a case: all effects in turn, on both aircraft, in both airs."""
    effects, aircraft = list(EFFECTS), list(AIRCRAFT)
    effect = effects[number % len(effects)]
    plane = aircraft[(number + number // len(effects)) % 2]
    return plane, effect, "light" if (number // (2 * len(effects))) % 2 else "none"


def _case(number: int) -> dict[str, Any]:
    plane, effect, air = drawn(number)
    withheld = EFFECTS[effect][0][plane]
    label = {"number": number, "aircraft": plane, "withheld": effect, "air": air}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model = _model(plane, folder)
        aircraft = _file(plane, model)
        simulator = user_simulator(f"jsbsim:{model}", aircraft)
        try:
            write_flights(folder, simulator.survey, aircraft, withheld, air, 1000 + number)
        except DivergedError as error:
            return {**label, "failed": str(error)}
        fitted, held = (load(folder / name, aircraft) for name in ("fitted", "held"))
        found = diagnose([fitted], holdout=[held], simulator=f"jsbsim:{model}")
        return {**label, **_told(found), "by_truth": _by_truth(found, simulator, withheld, folder)}


def _model(plane: str, folder: Path) -> str:
    if plane == "c172p":
        return plane
    aircraft = load_aircraft(plane)
    path = folder / "user" / plane / f"{plane}.xml"
    path.parent.mkdir(parents=True)
    path.write_text(jsbsim_model(aircraft, {"actuator_lag": dict.fromkeys(aircraft.controls, _SERVO)}))
    return str(path)


def _file(plane: str, model: str) -> Aircraft:
    """The imported file, with the instruments' noise of this package's aircraft where it is one."""
    imported = read_jsbsim(model, AIRCRAFT[plane], 900.0).aircraft
    return imported if plane == "c172p" else replace(imported, noise=load_aircraft(plane).noise)


def _told(found: GapDiagnosis) -> dict[str, Any]:
    content = found.document
    causes = [{k: c[k] for k in ("label", "parameters", "probability", "indistinguishable_from")} for c in found.causes]
    there = {k: content["reflown"][k] for k in ("before", "after", "noise_floor", "shrink_percent", "ci95", "left_out")}
    return {"verdict": found.verdict, "causes": causes, "reflown": there}


def _by_truth(found: GapDiagnosis, user: UserSimulator, withheld: Withheld, folder: Path) -> dict[str, float] | None:
    """The gap as flown in JSBSim by reality's own model; a servo's effect is written into it with its true size."""
    if not withheld:
        return None
    models = found.diagnosis.models
    files = edited(user.survey, folder / "truth", withheld)
    effects: dict[str, dict[str, UncertainValue]] = {}
    if "servo" in withheld:
        servo = withheld["servo"]
        control = str(servo["control"])
        own = user.aircraft.effect_values().get("actuator_lag", {}).get(control, 0.0)
        if "lag" in servo:  # the model's own servo follows that of reality
            effects["actuator_lag"] = {**user.aircraft.effects.get("actuator_lag", {}),
                                       control: UncertainValue(own + float(servo["lag"]))}  # fmt: skip
        if "lost" in servo:
            effects["control_effectiveness_loss"] = {control: UncertainValue(float(servo["lost"]))}
        after = replace(user.aircraft, effects={**user.aircraft.effects, **effects})
        files = user.corrected(after, folder / "servo").files
    simulator = models[0].simulator
    shift = {"cg_shift": {"x": float(withheld["cg"]["forward"])}} if "cg" in withheld else {}
    theta = simulator.vector(shift) if shift else simulator.neutral()
    flyers = [JsbsimFlyer(user.survey, each, user.aircraft, simulator.rate) for each in (user.survey.files, files)]
    result = reflown(models, [np.asarray(theta)] * len(models), flyers[0], flyers[1])
    return None if result is None else {"before": result.gap.before, "after": result.gap.after}


def _row(case: Mapping[str, Any]) -> list[str]:
    head = [case["aircraft"], case["withheld"], case["air"]]
    if "failed" in case:
        return [*head, "not flown", case["failed"], "", "", "", ""]
    _, wanted, true = EFFECTS[case["withheld"]]
    causes = case["causes"]
    labels = [c["label"] for c in causes]
    alternatives = [each for c in causes for each in c["indistinguishable_from"]]
    named = (
        "yes"
        if (wanted in labels or (not wanted and case["verdict"] == "no_gap"))
        else ("as an alternative" if wanted in alternatives else "no")
    )
    every = [(name, *pair) for c in causes for name, pair in list(c["parameters"].items())[:3]]
    sizes = "; ".join(f"{name} {value:.3g} ± {1.96 * error:.2g}" for name, value, error in every)
    sizes += f" (true {true[case['aircraft']]:g})" if true else ""
    there, truth = case["reflown"], case["by_truth"]
    closed, share = "-", "-"
    if there["before"] is not None and wanted:
        closed = (
            f"{100 * there['before']:.0f} to {100 * there['after']:.0f} %, floor {100 * there['noise_floor']:.0f} %"
        )
    if truth and there["before"] is not None and truth["before"] - truth["after"] > 0.0:
        ratio = (there["before"] - there["after"]) / (truth["before"] - truth["after"])
        share = f"{100 * ratio:.0f} %"
    return [*head, case["verdict"], ", ".join(labels) or "-", named, sizes, closed, share]


if __name__ == "__main__":
    main()
