"""The adaptive controller against the fixed baseline.

    python -m bench.closed_loop.adaptation --page docs/results/closed_loop.md

Simulator, online estimator, exciter and controller in one process, calling what the nodes call. Something fails at
30 s; the tracking error is that of the true attitude from the reference model's, over the seconds from 10 s after the
failure on, while neither of the two flights compared is excited, and again all the while. `--draws 200` flies as many
random failures, noises and turbulences, each with and without adaptation, and keeps its results in a file as they come;
`--exciter` counts the seconds of excitation that stopping early saves. `--method iv_rft` has all of it flown with
instrumental variables instead of least squares.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.closed_loop.flights import EXCITATION, RATE, Flown, Sortie, aft, baseline, fly, icing
from bench.pages import publish, table
from sysid_node.online.settings import METHODS
from sysid_node.sim.flying.live import LiveConditions
from sysid_node.sim.pages.line_chart import LineChart, draw

Array = NDArray[np.float64]

NAME = "bench/closed_loop/adaptation.py"

FAILURES: dict[str, tuple[str, ...]] = {
    "nothing wrong": (),
    "elevator at 40 % of its effect": ("control_effectiveness_loss:elevator=0.6",),
    "CG aft: statically unstable by 3 % of the chord": aft(-0.03),
    "aileron at 50 % of its effect": ("control_effectiveness_loss:aileron=0.5",),
    "ice all over (Bragg)": icing(1.0),
    "ice, 2.5 times that": icing(2.5),
}
#: Of pitch, roll and sideslip, the one that a failure disturbs most.
STRUCK = dict(zip(FAILURES, (None, 0, 0, 1, None, None), strict=True))
ONSET, SETTLED, END = 30.0, 40.0, 60.0  # s
LEAST_CALM = 2.0  # s without excitation, for a flight's errors to count
DRAW = (20.0, 45.0)  # s, onset and end of a random flight
FIXED = 60.0  # s of excitation when nobody looks
ASKED = ("Cm_de", "Cm_alpha")


def failures(turbulence: str, flights: int, method: str) -> str:
    """The table of failures: mean of several flights."""
    rows = []
    for name, effects in FAILURES.items():
        airs = [LiveConditions(turbulence, seed=seed + 1) for seed in range(flights)]
        pairs = [both(Sortie(effects, ONSET, END, air, method=method)) for air in airs]
        whole = np.array([[flown.error(SETTLED, END) for flown in pair] for pair in pairs])
        rest = [pair for pair in pairs if calm(*pair) >= LEAST_CALM]
        quiet = np.array(
            [[flown.error(SETTLED, END, excited(*pair)[: flown.time.size]) for flown in pair] for pair in rest]
        )
        quiet = quiet.reshape(-1, 2, 3)
        cells = [f"{b:.2f} / {a:.2f}" for b, a in np.rad2deg(quiet.mean(axis=0)).T] if rest else ["-"] * 3
        seconds = np.mean([spent(adapted) for _, adapted in pairs])
        judged = [*shares(quiet), struck(quiet, STRUCK[name]), f"{len(rest)} of {flights}"]
        rows.append([name, *cells, *judged, shares(whole)[0], f"{seconds:.1f}"])
    heads = (
        "pitch: baseline / adapted, deg",
        "roll",
        "sideslip",
        "adapted over baseline",
        "worst",
        "of what failed: worst",
    )
    tail = ("flights with a calm", "... excitation included", "excitation after the failure, s")
    return table((f"turbulence: {turbulence}", *heads, *tail), rows)


def excited(fixed: Flown, adapted: Flown) -> NDArray[np.bool_]:
    """(N,) whether either flight is being excited, or was within the last second; N of the longer one."""
    either = np.zeros(max(fixed.time.size, adapted.time.size))
    for flown in (fixed, adapted):
        either[: flown.time.size] += flown.exciting
    return np.asarray(np.convolve(either, np.ones(round(RATE) + 1))[: either.size] > 0.0)


def calm(fixed: Flown, adapted: Flown) -> float:
    """Seconds of the time that counts in which neither flight is excited."""
    time = max(fixed.time, adapted.time, key=len)
    counts = (time >= SETTLED) & (time < END) & ~excited(fixed, adapted)
    return float(np.count_nonzero(counts) / RATE)


def shares(errors: Array) -> tuple[str, str]:
    """Mean and largest of adapted over baseline, pitch and roll together, of errors (flights, 2, 3)."""
    if not len(errors):
        return "-", "-"
    size = np.hypot(errors[..., 0], errors[..., 1])
    share = size[:, 1] / size[:, 0]
    return f"{share.mean():.2f}", f"{share.max():.2f}"


def struck(errors: Array, axis: int | None) -> str:
    """Largest of adapted over baseline of one axis alone."""
    return "-" if axis is None or not len(errors) else f"{(errors[:, 1, axis] / errors[:, 0, axis]).max():.2f}"


def spent(flown: Flown) -> float:
    """Seconds of excitation after the failure."""
    return float(np.count_nonzero(flown.exciting & (flown.time >= ONSET)) / RATE)


def both(sortie: Sortie) -> tuple[Flown, Flown]:
    """Without and with adaptation."""
    return fly(baseline(sortie)), fly(sortie)


def random_sortie(seed: int) -> Sortie:
    """A failure, an air, noise and set-points at random."""
    draw = np.random.default_rng(seed)
    kinds: list[Sequence[str]] = [
        (),
        (f"control_effectiveness_loss:elevator={draw.uniform(0.1, 0.7):.3f}",),
        (f"control_effectiveness_loss:aileron={draw.uniform(0.1, 0.7):.3f}",),
        (f"control_effectiveness_loss:rudder={draw.uniform(0.1, 0.7):.3f}",),
        aft(draw.uniform(-0.04, 0.06)),
        icing(draw.uniform(0.3, 3.0)),
    ]
    effects = tuple(kinds[draw.integers(len(kinds))])
    turbulence = ("none", "light", "moderate")[draw.integers(3)]
    air = LiveConditions(turbulence, noise=draw.uniform(0.5, 2.0), seed=seed)
    excitation = EXCITATION if draw.random() < 0.75 else replace(EXCITATION, longest=1.0)
    return Sortie(effects, *DRAW, air, excitation=excitation, asked=draw.uniform(0.3, 1.3))


def draws(count: int, first: int, method: str, results: Path) -> str:
    """Fly what is not yet in the file of results, and sum up."""
    known = [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
    for seed in range(first + len(known), first + count):
        sortie = replace(random_sortie(seed), method=method)
        fixed, adapted = both(sortie)
        row = {
            "seed": seed,
            "effects": sortie.effects,
            "turbulence": sortie.air.turbulence,
            "lost": [fixed.lost, adapted.lost],
            "errors": [flown.error(DRAW[0] + 10.0, DRAW[1]).tolist() for flown in (fixed, adapted)],
        }
        known.append(row)
        with results.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
    return _summary(known[:count])


def _summary(rows: Sequence[dict[str, list[list[float]]]]) -> str:
    cells = []
    for turbulence in ("none", "light", "moderate"):
        chosen = [row for row in rows if str(row["turbulence"]) == turbulence]
        lost = np.isfinite(np.array([row["lost"] for row in chosen], dtype=float))
        errors = np.array([row["errors"] for row in chosen], dtype=float)
        size = np.hypot(errors[..., 0], errors[..., 1])
        with np.errstate(invalid="ignore"):
            share = size[:, 1] / size[:, 0]
        share = share[np.isfinite(share)]
        middle = np.rad2deg(np.median(size, axis=0))
        quantiles = [f"{q:.2f}" for q in np.quantile(share, [0.05, 0.5, 0.95])]
        counts = [lost[:, 0].sum(), lost[:, 1].sum(), (lost[:, 1] & ~lost[:, 0]).sum()]
        error = f"{middle[0]:.2f} / {middle[1]:.2f}"
        cells.append([turbulence, str(len(chosen)), *(str(int(n)) for n in counts), error, *quantiles])
    heads = ("flights", "lost by the baseline", "lost adapted", "... that the baseline kept")
    tail = ("error: baseline / adapted, median, deg", "adapted over baseline: 5 %", "median", "95 %")
    return table(("turbulence", *heads, *tail), cells)


def exciter(flights: int, method: str) -> str:
    """The table of excitation time."""
    rows = []
    for turbulence in ("none", "light"):
        for amplitude in (0.02, 0.04):
            spec = f"multisine:elevator,aileron,rudder:amplitude={amplitude}:length=15:low=0.15:high=1.9"
            settings = replace(EXCITATION, manoeuvre=(spec,), derivatives=ASKED, accuracy=0.05, watch=False)
            took = []
            for seed in range(flights):
                air = LiveConditions(turbulence, seed=seed + 1)
                flown = fly(Sortie((), 1e9, FIXED + 4.0, air, False, settings, method=method))
                ends = [event.time for event in flown.events if event.text.startswith("known")]
                took.append(ends[0] - flown.events[0].time if ends else FIXED)
            known = sum(t < FIXED for t in took)
            row = (np.median(took), max(took), FIXED - np.mean(took))
            rows.append([turbulence, f"{amplitude:g}", f"{known} of {flights}", *(f"{x:.1f}" for x in row)])
    heads = ("amplitude, rad", "known within 60 s", "after s: median", "longest", "saved on average, s")
    return table(("turbulence", *heads), rows)


def picture(path: Path) -> None:
    """Pitch around the elevator's failure, adapted beside the baseline."""
    panels = []
    for name, axis in (("elevator at 40 % of its effect", 0), ("aileron at 50 % of its effect", 1)):
        fixed, adapted = both(Sortie(FAILURES[name], ONSET, END, LiveConditions(seed=1)))
        off = [np.rad2deg((flown.attitude - flown.wanted)[:, axis]) for flown in (fixed, adapted)]
        panels.append(LineChart(f"{name}: {('pitch', 'roll')[axis]} error, deg", fixed.time, *off))
    path.write_text(draw(panels, "tracking error, baseline grey, adapted blue"), encoding="utf-8")


def main() -> None:
    """Print the tables, or put them in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=4, help="for each row (default: 4)")
    parser.add_argument("--turbulence", default="none", help="none, light, moderate or severe (default: none)")
    parser.add_argument("--draws", type=int, default=0, help="fly so many random failures instead")
    parser.add_argument("--first", type=int, default=1, help="seed of the first of them (default: 1)")
    parser.add_argument("--results", type=Path, default=Path("out/closed_loop_draws.jsonl"), help="of the draws")
    parser.add_argument("--exciter", action="store_true", help="count seconds of excitation instead")
    parser.add_argument("--method", choices=METHODS, default=Sortie.method, help="of the estimator (default: sls_rft)")
    parser.add_argument("--picture", type=Path, help="SVG file to draw instead")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    if args.picture:
        picture(args.picture)
        return
    publish(*_told(args), args.page)


def _told(args: argparse.Namespace) -> tuple[str, str]:
    """Name and table of what was asked for."""
    by = "" if args.method == Sortie.method else f" --method {args.method}"
    if args.draws:
        args.results.parent.mkdir(parents=True, exist_ok=True)
        begun = "" if args.first == 1 else f" --first {args.first}"
        text = draws(args.draws, args.first, args.method, args.results)
        return f"{NAME} --draws{begun}{by}", text
    if args.exciter:
        return f"{NAME} --exciter{by}", exciter(args.flights, args.method)
    air = "" if args.turbulence == "none" else f" --turbulence {args.turbulence}"
    return f"{NAME}{air}{by}", failures(args.turbulence, args.flights, args.method)


if __name__ == "__main__":
    main()
