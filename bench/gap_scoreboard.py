"""A scoreboard of ``sysid gap``: effects drawn at random, flown by plants in processes of their own, labels sealed.

    python bench/gap_scoreboard.py --cases 20 --seed 1 --out out/gap_scoreboard

Each plant flies this project's simulator at another integration rate, derivatives drawn from half their tolerances,
with an autopilot and noise, and hands over two bags and nothing else; its label goes to ``labels/``, which only the
scoring opens. Cases that are finished are kept: the same command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np

STEPS = [
    "3211:elevator:amplitude=0.06:width=0.3:start=1:every=8:repeat=5",
    "3211:aileron:amplitude=0.06:width=0.25:start=4:every=8:repeat=5",
    "3211:rudder:amplitude=0.12:width=0.3:start=6:every=8:repeat=5",
]

#: Effects that are drawn, and the ranges of their sizes, either sign where the effect allows it.
EFFECTS: dict[str, dict[str, tuple[float, float]]] = {
    "none": {},
    "actuator_lag": {"time_constant": (0.04, 0.12)},
    "command_delay": {"delay": (0.03, 0.09)},
    "actuator_rate_limit": {"rate": (0.4, 0.9)},
    "actuator_backlash": {"elevator": (0.02, 0.04)},
    "control_effectiveness_loss": {"elevator": (0.4, 0.7), "onset": (12.0, 28.0)},
    "nonlinear_pitching_moment": {"quadratic": (1.5, 3.0)},
    "lateral_asymmetry": {"Cl_0": (0.01, 0.03)},
    "imu_lever_arm": {"x": (0.2, 0.4)},
    "air_data_delay": {"delay": (0.04, 0.1)},
    "vane_scale": {"alpha": (0.25, 0.4)},
    "cg_shift": {"x": (0.03, 0.05)},
}


def draw(seed: int) -> dict[str, object]:
    """A case: effect, sizes, turbulence, and the derivatives' errors are drawn by the plant."""
    random = np.random.default_rng([20260101, seed])
    name = str(random.choice(list(EFFECTS)))
    sizes = {key: float(random.uniform(*span)) for key, span in EFFECTS[name].items()}
    return {"seed": seed, "effect": name, "sizes": sizes, "turbulence": str(random.choice(["none", "light"]))}


def plant(seed: int, folder: Path) -> None:
    """Flies one case twice, and seals its label. Runs in a process of its own."""
    from sysid_node.aircraft.load import load_aircraft  # noqa: PLC0415
    from sysid_node.cli.main import main as sysid  # noqa: PLC0415

    case = draw(seed)
    random = np.random.default_rng([20260102, seed])
    errors = [
        f"{name}={0.5 * d.tolerance * random.standard_normal():.6g}"
        for name, d in load_aircraft("cdrw").derivatives.items()
        if d.tolerance
    ]
    effects = [":".join(["derivative_error", *errors])]
    if case["effect"] != "none":
        sizes = dict(case["sizes"])  # type: ignore[call-overload]
        effects.append(":".join([str(case["effect"]), *(f"{k}={v:.6g}" for k, v in sizes.items())]))
    for i, bag in enumerate(("fitted", "held")):
        words = ["simulate", "--quiet", "--aircraft", "cdrw", "--duration", "42", "--seed", str(1000 * seed + i)]
        words += ["--turbulence", str(case["turbulence"]), "--rate", "250", "--out", str(folder / f"{seed}_{bag}")]
        words += [w for spec in STEPS for w in ("--manoeuvre", spec)] + [w for e in effects for w in ("--effect", e)]
        if sysid(words):
            sys.exit(1)
    labels = folder / "labels"
    labels.mkdir(exist_ok=True)
    (labels / f"{seed}.json").write_text(json.dumps(case), encoding="utf-8")


def judge(case: dict[str, object], found: dict[str, object]) -> dict[str, object]:
    """What was right of a diagnosis."""
    causes = list(found["causes"])  # type: ignore[call-overload]
    named = {c["effect"] for c in causes} | {r for c in causes for r in c["indistinguishable_from"][:2]}
    gap = dict(found["gap"])  # type: ignore[call-overload]
    first = causes[0]["effect"] if causes else str(found["verdict"])
    right = found["verdict"] == "no_gap" if case["effect"] == "none" else case["effect"] in named
    sizes = {k: v for c in causes if c["effect"] == case["effect"] for k, (v, _) in c["parameters"].items()}
    return {
        "truth": case["effect"],
        "turbulence": case["turbulence"],
        "verdict": found["verdict"],
        "first": first,
        "right": bool(right),
        "sizes": {"true": case["sizes"], "found": {k: sizes[k] for k in dict(case["sizes"]) if k in sizes}},  # type: ignore[call-overload]
        "gap": [round(gap[k], 3) for k in ("before", "tolerances", "after", "noise_floor")],
    }


def run_case(seed: int, folder: Path) -> dict[str, object] | None:
    """One case, flown and diagnosed; None where it could not be flown."""
    result = folder / f"{seed}_out" / "gap.json"
    if not result.exists():
        words = [sys.executable, __file__, "--plant", str(seed), "--out", str(folder)]
        if not (folder / "labels" / f"{seed}.json").exists() and subprocess.run(words, check=False).returncode:
            return None
        bags = [str(folder / f"{seed}_fitted"), "--holdout", str(folder / f"{seed}_held")]
        words = [sys.executable, "-m", "sysid_node.cli", "gap", *bags, "--aircraft", "cdrw", "--quiet"]
        if subprocess.run([*words, "--out", str(result.parent)], check=False).returncode:
            return None
    label = json.loads((folder / "labels" / f"{seed}.json").read_text(encoding="utf-8"))
    return judge(label, json.loads(result.read_text(encoding="utf-8")))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1, help="of the first case")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--plant", type=int, help=argparse.SUPPRESS)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    if args.plant is not None:
        plant(args.plant, args.out)
        return
    judged = []
    for seed in range(args.seed, args.seed + args.cases):
        case = run_case(seed, args.out)
        print(seed, "not flown" if case is None else json.dumps(case), flush=True)
        judged += [case] if case is not None else []
    right = Counter((c["turbulence"], c["truth"] == "none") for c in judged if c["right"])
    total = Counter((c["turbulence"], c["truth"] == "none") for c in judged)
    for key in sorted(total):
        what = "no effect: no_gap" if key[1] else "one effect: named, or in a named set of three"
        print(f"turbulence {key[0]}, {what}: {right[key]} of {total[key]}")


if __name__ == "__main__":
    main()
