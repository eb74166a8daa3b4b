"""The diagnosis where simulator and reality are both JSBSim: `python -m bench.gap.reflown LEDGER [--cases N]`

The user's simulator is a plain JSBSim model; reality is the same model with an effect that is withheld: one of the
list, two at once, one that is on no list, or none. Each case is drawn from its seed. The simulator is known by its
model (``sysid import``, ``--simulator``) or by flights recorded in it (``--simulated``). What the correction closes in
JSBSim stands beside what the true effect closes there.

A case is added to the ledger as it ends; started again, the bench goes on with the next seed. Each line holds a digest
of the sources that decide, and a case is added only to cases of the present sources. ``--page FILE`` puts the tables
into a page.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.pages import publish, table
from bench.withheld.jsbsim import scoring
from bench.withheld.jsbsim.drawing import AIRCRAFT, SETS, Case, Withheld, draw, draw_withheld
from bench.withheld.jsbsim.flights import World, write_flights
from bench.withheld.jsbsim.reality import edited
from bench.withheld.ledger import version
from bench.withheld.plants.motion import DivergedError
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, Derivative, UncertainValue
from sysid_node.api.compiled_programs import release_compiled_programs
from sysid_node.api.flight_file import load
from sysid_node.api.gap_diagnosis import GapDiagnosis, diagnose
from sysid_node.flight.record import Array
from sysid_node.gap.estimation.predictive_density import transferred_parameters
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.validation.reflown import reflown
from sysid_node.sim.correcting.jsbsim_flight import JsbsimFlyer
from sysid_node.sim.correcting.user_simulator import UserSimulator, user_simulator
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.importing.jsbsim.read import read_jsbsim

#: Servos that the exported model of ``kestrel`` has, s.
_SERVO = 0.03

#: Tolerance (1 sigma) of the first guesses that are given with simulated flights, as a share of each derivative.
_GUESS = 0.1


def main() -> None:
    """Run cases, or put the tables in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("ledger", type=Path, help="a line of JSON a case")
    parser.add_argument("--set", choices=SETS, default="development", help="of seeds; the final one is run once")
    parser.add_argument("--cases", type=int, default=0, help="cases to have in the ledger")
    parser.add_argument("--seeds", type=int, nargs="+", help="these cases alone")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    done = _read(args.ledger)
    for seed in args.seeds or range(1, args.cases + 1):
        if seed not in done:
            _require_version(args.ledger, done)
            done[seed] = {**_case(args.set, draw(args.set, seed)), "version": version()}
            with args.ledger.open("a") as file:
                file.write(json.dumps(done[seed]) + "\n")
            print(" | ".join(_row(done[seed])), flush=True)
            release_compiled_programs()
    cases = [case for _, case in sorted(done.items())]
    publish("bench.gap.reflown", _page(cases), args.page)


def _read(ledger: Path) -> dict[int, dict[str, Any]]:
    lines = ledger.read_text().splitlines() if ledger.exists() else []
    return {case["seed"]: case for case in map(json.loads, lines)}


def _require_version(ledger: Path, done: Mapping[int, Mapping[str, Any]]) -> None:
    others = {case["version"] for case in done.values()} - {version()}
    if others:
        sys.exit(f"{ledger}: holds cases of the sources {', '.join(others)}, not {version()}; take another file")


def _case(which: str, case: Case) -> dict[str, Any]:
    began = time.process_time()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model = _model(case.aircraft, folder)
        aircraft = _file(case.aircraft, model)
        simulator = user_simulator(f"jsbsim:{model}", aircraft)
        withheld = draw_withheld(which, case, aircraft)
        own = aircraft.effect_values()
        true = {name: {key: value + _own(own, name, key) for key, value in values.items()}
                for name, values in withheld.effects.items()}  # fmt: skip
        label = {**asdict(case), "true_sizes": true, "unlisted": dict(withheld.unlisted)}
        seed = [*SETS.values()][0 if which == "development" else 1] + 10 * case.seed
        world = World(simulator.survey, aircraft, withheld)
        try:
            write_flights(folder, ("fitted", "held"), world, case.turbulence, 1.0, seed)
            found = _diagnosed(case, folder, world, f"jsbsim:{model}", seed + 1)
        except DivergedError as error:
            return {**label, "failed": str(error)}
        truth = _by_truth(found, simulator, withheld, true, folder) if case.way == "import" else None
        return {**label, **_told(found), "by_truth": truth, "processor_s": time.process_time() - began}


def _own(effects: Mapping[str, Mapping[str, float]], name: str, key: str) -> float:
    """What the plain model has of an effect: a servo's lag is added to its own."""
    return effects.get(name, {}).get(key, 0.0) if name == "actuator_lag" else 0.0


def _diagnosed(case: Case, folder: Path, world: World, model: str, seed: int) -> GapDiagnosis:
    """By the model, or by two flights of it without noise and a file of first guesses. Raises DivergedError."""
    if case.way == "import":
        fitted, held = (load(folder / name, world.aircraft) for name in ("fitted", "held"))
        return diagnose([fitted], holdout=[held], simulator=model)
    write_flights(folder, ("first", "second"), replace(world, withheld=Withheld()), "none", 0.0, seed)
    guess = _first_guess(world.aircraft, np.random.default_rng([seed, 2]))
    fitted, held, *simulated = (load(folder / name, guess) for name in ("fitted", "held", "first", "second"))
    return diagnose([fitted], holdout=[held], simulated=simulated)


def _first_guess(aircraft: Aircraft, random: np.random.Generator) -> Aircraft:
    """What a user knows of his simulator: masses and geometry, derivatives a little off, no effects and no tables."""
    guesses = {
        name: Derivative(
            known.value * (1.0 + _GUESS * float(np.clip(random.standard_normal(), -2.5, 2.5))),
            _GUESS * abs(known.value),
        )
        for name, known in aircraft.derivatives.items()
        if abs(known.value) > 1e-6
    }
    return replace(aircraft, derivatives=guesses, effects={}, tables=())


def _model(plane: str, folder: Path) -> str:
    if plane != "kestrel":
        return plane
    aircraft = load_aircraft(plane)
    path = folder / "user" / plane / f"{plane}.xml"
    path.parent.mkdir(parents=True)
    path.write_text(jsbsim_model(aircraft, {"actuator_lag": dict.fromkeys(aircraft.controls, _SERVO)}))
    return str(path)


def _file(plane: str, model: str) -> Aircraft:
    """The imported file, with the instruments' noise of this package's aircraft where it is one."""
    imported = read_jsbsim(model, *AIRCRAFT[plane]).aircraft
    return replace(imported, noise=load_aircraft(plane).noise) if plane == "kestrel" else imported


def _told(found: GapDiagnosis) -> dict[str, Any]:
    content = found.document
    causes = [{k: c[k] for k in ("effect", "label", "parameters", "probability", "indistinguishable_from")}
              for c in content["causes"]]  # fmt: skip
    gap = {k: content["gap"][k] for k in ("before", "after", "noise_floor")}
    there, surrogate = content.get("reflown"), content.get("surrogate")
    kept = ("before", "after", "noise_floor", "shrink_percent", "ci95", "left_out")
    return {
        "verdict": found.verdict,
        "causes": causes,
        "gap": gap,
        "reflown": there and {k: there[k] for k in kept},
        "surrogate_error": surrogate and surrogate["error"],
    }


def _by_truth(
    found: GapDiagnosis, user: UserSimulator, withheld: Withheld, true: Mapping[str, Mapping[str, float]], folder: Path
) -> dict[str, float] | None:
    """The gap as flown in JSBSim by reality's own model; servos' effects are written into it with their true sizes."""
    if not set(withheld.effects) - set(withheld.of_instruments()):
        return None
    models = found.diagnosis.models
    files = edited(user.survey, folder / "truth", withheld)
    effects = dict(user.aircraft.effects)
    for control in user.aircraft.controls:
        for name in withheld.servo(control):
            effects[name] = {**effects.get(name, {}), control: UncertainValue(true[name][control])}
    if effects != user.aircraft.effects:
        edited_user = replace(user, survey=replace(user.survey, files=files))
        files = edited_user.corrected(replace(user.aircraft, effects=effects), folder / "servo").files
    simulator = models[0].simulator
    seen = {name: dict(values) for name, values in true.items() if name in {*withheld.of_instruments(), "cg_shift"}}
    thetas = [_with_true(found, model, np.asarray(simulator.vector(seen) if seen else simulator.neutral()), set(seen))
              for model in models]  # fmt: skip
    flyers = [JsbsimFlyer(user.survey, each, user.aircraft, simulator.rate) for each in (user.survey.files, files)]
    result = reflown(models, thetas, flyers[0], flyers[1])
    return None if result is None else {"before": result.gap.before, "after": result.gap.after}


def _with_true(found: GapDiagnosis, model: ResidualModel, true: Array, effects: set[str]) -> Array:
    """Parameters (P,) of a flight as fitted, biases among them, with the true sizes of what is in the instruments."""
    attribution = found.diagnosis.attribution
    replaced = effects | {cause.candidate.effect for cause in attribution.causes}
    point = np.array(transferred_parameters(attribution.corrected, model))
    changed = [i for i, name in enumerate(model.simulator.names) if name.partition(".")[0] in replaced]
    point[changed] = true[changed]
    return point


def _page(cases: list[dict[str, Any]]) -> str:
    if not cases:
        return "No case was diagnosed."
    flown = [case for case in cases if "failed" not in case]
    counts = ", ".join(f"{sum(c['way'] == way for c in flown)} by `{option}`"
                       for way, option in (("import", "--simulator"), ("simulated", "--simulated")))  # fmt: skip
    scores = table(("", "all", "`--simulator`", "`--simulated`", "wanted"), scoring.rows(flown))
    heads = ("seed", "aircraft", "way in", "air", "withheld", "verdict: causes (probability)", "right",
             "sizes: true, found", "gap %", "JSBSim %", "of what the true effect closes")  # fmt: skip
    return (
        f"{len(flown)} of the 150 cases that are wanted were run ({counts}); in brackets 95 % intervals.\n\n{scores}"
        f"\n\nBy aircraft and by what was withheld:\n\n{_counts(flown)}"
        f"\n\nCase by case:\n\n{table(heads, [_row(case) for case in cases])}"
    )


def _counts(cases: list[dict[str, Any]]) -> str:
    """Cases that are right, of how many, by aircraft and by effect; a case of two effects counts for both."""
    groups: dict[str, list[bool]] = {f"`{name}`": [] for name in AIRCRAFT}
    for case in cases:
        withheld = [*case["true_sizes"], *case["unlisted"]] or ["nothing"]
        for name in (f"`{case['aircraft']}`", *withheld):
            groups.setdefault(name, []).append(scoring.named(case))
    return table(("", "right"), [[name, f"{sum(flags)} of {len(flags)}"] for name, flags in groups.items() if flags])


def _row(case: Mapping[str, Any]) -> list[str]:
    effects = [f"{name} {key} {value:.3g}" for name, v in case["true_sizes"].items() for key, value in v.items()]
    effects += [f"{name} {value:.2g}" for name, value in case["unlisted"].items()]
    error = case.get("surrogate_error")
    way = case["way"] if error is None else f"{case['way']}, known to {100.0 * error:.0f} %"
    head = [str(case["seed"]), case["aircraft"], way, case["turbulence"], "; ".join(effects) or "nothing"]
    if "failed" in case:
        return [*head, f"not flown: {case['failed']}", "", "", "", "", ""]
    causes = "; ".join("/".join([c["label"], *c["indistinguishable_from"][:2]]) + f" ({c['probability']:.2f})"
                       for c in case["causes"])  # fmt: skip
    sizes = "; ".join(f"{true:.3g}, {found:.3g} ± {1.96 * e:.2g}" for _, true, found, e in scoring.sizes(case))
    there, share = case["reflown"], scoring.closed_of_true(case)
    return [
        *head,
        f"{case['verdict']}: {causes or '-'}",
        "yes" if scoring.named(case) else "no",
        sizes or "-",
        _fall(case["gap"]),
        _fall(there) if there and there["before"] is not None else "-",
        "-" if share is None else f"{100 * share:.0f} %",
    ]


def _fall(gap: Mapping[str, float]) -> str:
    before, after, floor = (100.0 * gap[k] for k in ("before", "after", "noise_floor"))
    return f"{before:.0f} to {after:.1f} (floor {floor:.1f})"


if __name__ == "__main__":
    main()
