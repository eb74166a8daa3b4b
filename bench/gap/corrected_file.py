"""What a second diagnosis says of the same flights, held against the corrected file of the first one.

    python -m bench.gap.corrected_file [--page docs/results/gap_again.md]

Two flights in still air each, as in bench/gap/effects.py: a 3-2-1-1 is fitted and a multisine is held out, both with a
throttle doublet. The derivatives of the file are off by draws from their tolerances. Some files state the servos. The
sizes were chosen before the first run. Finished cases are kept in `--out`, so that the command goes on where it
stopped.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.gap.effects import PLANS, believed, fly
from bench.pages import publish, table
from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft, parse_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.gap.correction import corrected_aircraft
from sysid_node.gap.diagnose import Diagnosis, diagnose
from sysid_node.gap.document import document

AIRCRAFT = "cdrw"
SERVOS = {"actuator_lag": dict.fromkeys(("elevator", "aileron", "rudder"), UncertainValue(0.03, 0.006))}


@dataclass(frozen=True)
class Case:
    """What is flown beside what the file states."""

    name: str
    flown: tuple[str, ...]
    servos: bool = False  # whether the file states the servos


#: ``flown`` replaces what the file states, as ``sysid simulate --effect`` does.
CASES = (
    Case("servos as the file says", (), servos=True),
    Case("servos of 30 ms, and the file says nothing", ("actuator_lag:time_constant=0.03",)),
    Case("one slow servo", ("actuator_lag:elevator=0.118",), servos=True),
    Case("one slow servo, and the file says nothing", ("actuator_lag:elevator=0.118:aileron=0.03:rudder=0.03",)),
    Case("slow servos of second order", ("actuator_lag:time_constant=0.06:damping=0.7",), servos=True),
    Case("late commands", ("command_delay:delay=0.06",), servos=True),
    Case("one rate limit", ("actuator_rate_limit:aileron=0.4",), servos=True),
    Case("a lag of the air data", ("air_data_lag:time_constant=0.08",), servos=True),
    Case("slow aileron and more mass", ("actuator_lag:aileron=0.1", "mass_error:error=0.15"), servos=True),
    Case("late commands and less thrust", ("command_delay:delay=0.06", "thrust_scale:error=-0.25"), servos=True),
)


def told(case: Case, number: int) -> dict[str, Any]:
    """What both diagnoses say of one case."""
    truth = flown_aircraft(servos=case.servos)
    belief = believed(truth, np.random.default_rng(number))
    flights = [fly(truth, belief, case.flown, plan, 100 * number + k, True) for k, plan in enumerate(PLANS)]
    first = diagnose(belief, flights[:1], flights[1:])
    corrected = parse_aircraft(dump_aircraft(corrected_aircraft(first)))
    second = diagnose(corrected, flights[:1], flights[1:])
    return {"first": _shown(first), "second": _shown(second), "effects": _effects(corrected)}


def flown_aircraft(*, servos: bool) -> Aircraft:
    """The aircraft that is flown, with servos of 30 ms where the file states them."""
    truth = load_aircraft(AIRCRAFT)
    return replace(truth, effects=SERVOS) if servos else truth


def _shown(found: Diagnosis) -> dict[str, Any]:
    content = document(found)
    return {"verdict": content["verdict"], "causes": content["causes"], "gap": content["gap"]}


def _effects(aircraft: Aircraft) -> dict[str, dict[str, float]]:
    return aircraft.effect_values()


def row(case: Case, found: Mapping[str, Any]) -> list[str]:
    """Of the table."""
    first, second = found["first"], found["second"]
    sizes = " → ".join(f"{100.0 * first['gap'][k]:.1f}" for k in ("before", "after"))
    again = " → ".join(f"{100.0 * second['gap'][k]:.1f}" for k in ("before", "after"))
    flown = ", ".join(f"`{effect}`" for effect in case.flown) or "the file's effects alone"
    return [
        f"{case.name}: {flown}{' (file: servos 30 ms)' if case.servos else ''}",
        f"{first['verdict']}: {_causes(first)}",
        sizes,
        f"{second['verdict']}: {_causes(second)}",
        again,
        f"{100.0 * second['gap']['noise_floor']:.1f}",
    ]


def _causes(found: Mapping[str, Any]) -> str:
    """The causes with probability, sizes and standard errors, and what the file said."""
    return "; ".join(_cause(cause) for cause in found["causes"]) or "-"


def _cause(cause: Mapping[str, Any]) -> str:
    filed = cause.get("believed", {})
    sizes = [
        f"{key} {value:.3g} ({error:.2g})" + (f", file {filed[key]:.3g}" if key in filed else "")
        for key, (value, error) in cause["parameters"].items()
    ]
    rivals = f" or {', '.join(cause['indistinguishable_from'])}" if cause["indistinguishable_from"] else ""
    return f"{cause['label']}{rivals} {cause['probability']:.2f}: {', '.join(sizes)}"


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/gap_again"), help="folder of finished cases")
    parser.add_argument("--most", type=int, default=len(CASES), help="cases to run")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for number, case in enumerate(CASES[: args.most]):
        kept = args.out / f"{number}.json"
        if not kept.exists():
            kept.write_text(json.dumps(told(case, number)), encoding="utf-8")
        rows.append(row(case, json.loads(kept.read_text(encoding="utf-8"))))
    heads = ("flown", "first diagnosis", "gap %", "with corrected.yaml", "gap %", "floor")
    publish("bench/gap/corrected_file.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
