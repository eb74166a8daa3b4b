"""Whether abrupt changes of the aircraft are noticed, and no others. `python bench/changes.py`

The elevator loses part of its effect at 30 s while 3-2-1-1s (without the autopilot: doublets) go on: when is it
announced, and how far off is Cm_de four seconds later? Then hours of unchanged flight, the autopilot holding attitude,
with a doublet on each surface every minute: how often is a change announced that is none?
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from evaluation.flying import Setting, fly
from evaluation.judging import METHODS, Array, processes
from evaluation.pages import publish, table

from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.run import run
from sysid_node.online.settings import Settings
from sysid_node.online.types import Estimates

AIRCRAFT = "cdrw"
ONSET, AFTER = 30.0, 4.0  # s
DEMANDED = 0.15  # of Cm_de, AFTER s after the ONSET
FLIGHT = 45.0  # s
TIMES = np.arange(10, round(FLIGHT * 10)) / 10  # s, at which estimates are looked at
WEATHERS = [(turbulence, autopilot) for turbulence in ("none", "light", "moderate") for autopilot in (False, True)]
LOSSES = (0.5, 0.3, 0.2, 0.1)
DOUBLETS = tuple(
    f"doublet:{surface}:amplitude={amplitude}:width=0.35:start={start}:every=60:repeat=59"
    for surface, amplitude, start in (("elevator", 0.06, 10), ("aileron", 0.06, 25), ("rudder", 0.12, 40))
)
HOUR = 3600.0


def announced(estimates: Estimates) -> bool:
    """Whether a change is being announced."""
    return any(d.status == "changed" for d in estimates.derivatives.values())


def watch(setting: Setting, method: str, times: Array, seeds: Sequence[int]) -> list[tuple[Array, Array]]:
    """Of each flight: when a change was first announced (each time, s), and Cm_de with its validity (K, 2)."""
    batch, known = fly(AIRCRAFT, setting, seeds), load_aircraft(AIRCRAFT)
    seen = []
    for samples in batch.samples:
        history = run(known, METHODS[method].settings, batch.time, samples, times)
        said = np.array([announced(e) for e in history])
        starts = times[np.flatnonzero(said & ~np.roll(said, 1))]
        Cm_de = [e.derivatives["Cm_de"] for e in history]
        seen.append((starts, np.array([[d.value, d.valid] for d in Cm_de])))
    return seen


def flown(
    setting: Setting, method: str, times: Array, flights: int, pool: ProcessPoolExecutor, a_task: int = 10
) -> list[tuple[Array, Array]]:
    """``watch`` over so many flights."""
    parts = [list(range(i + 1, min(i + a_task, flights) + 1)) for i in range(0, flights, a_task)]
    return [one for part in pool.map(partial(watch, setting, method, times), parts) for one in part]


def losses(flights: int, method: str, pool: ProcessPoolExecutor) -> str:
    """The table of losses."""
    rows = []
    for turbulence, autopilot in WEATHERS:
        base = Setting("", turbulence, autopilot, seconds=FLIGHT)
        for loss in LOSSES:
            effects = {"control_effectiveness_loss": {"elevator": loss, "onset": ONSET}}
            seen = flown(replace(base, effects=effects), method, TIMES, flights, pool)
            loop = "closed loop" if autopilot else "open loop"
            rows.append([f"{turbulence}, {loop}", f"{100 * loss:.0f} %", *_found(seen, loss)])
    heads = ("turbulence", "loss", "announced", "after s: median", "worst", "falsely before")
    tail = (f"Cm_de off after {AFTER:g} s, %: median", "worst", f"within {100 * DEMANDED:.0f} %", "valid then")
    return table((*heads, *tail), rows)


def _found(seen: Sequence[tuple[Array, Array]], loss: float) -> list[str]:
    """What became of one loss in all flights."""
    truth = load_aircraft(AIRCRAFT).derivatives["Cm_de"].value * (1.0 - loss)
    found = [starts[starts >= ONSET][0] - ONSET for starts, _ in seen if (starts >= ONSET).any()]
    then = np.array([Cm_de[np.searchsorted(TIMES, ONSET + AFTER)] for _, Cm_de in seen])
    off = np.abs(then[:, 0] / truth - 1.0)
    return [
        f"{len(found)} of {len(seen)}",
        f"{np.median(found):.1f}" if found else "-",
        f"{max(found):.1f}" if found else "-",
        str(sum((starts < ONSET).any() for starts, _ in seen)),
        f"{100 * np.median(off):.1f}",
        f"{100 * off.max():.1f}",
        f"{np.count_nonzero(off < DEMANDED)} of {len(seen)}",
        f"{np.count_nonzero(then[:, 1])}",
    ]


def unchanged(hours: int, method: str, pool: ProcessPoolExecutor) -> str:
    """The table of hours in which nothing happens."""
    times = np.arange(1.0, HOUR, 0.5)
    rows = []
    for turbulence in ("none", "light", "moderate"):
        setting = Setting("", turbulence, manoeuvre=DOUBLETS, seconds=HOUR)
        seen = flown(setting, method, times, hours, pool, a_task=1)
        falsely = [len(starts) for starts, _ in seen]
        rows.append([turbulence, str(hours), str(sum(falsely)), str(sum(n > 0 for n in falsely))])
    return table(("turbulence, closed loop", "hours", "changes announced", "hours with any"), rows)


def main() -> None:
    """Print the tables, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=20, help="a loss and weather (default: 20)")
    parser.add_argument("--hours", type=int, default=2, help="of unchanged flight in each weather (default: 2)")
    parser.add_argument("--method", choices=METHODS, default=Settings().method)
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    with processes() as pool:
        parts = (losses(args.flights, args.method, pool), "Unchanged flight:", unchanged(args.hours, args.method, pool))
    publish("bench/changes.py", "\n\n".join(parts), args.page)


if __name__ == "__main__":
    main()
