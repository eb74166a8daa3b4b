"""Whether abrupt changes of the aircraft are noticed, and no others.

    python -m bench.estimation.changes

At 30 s the aircraft changes while 3-2-1-1s (without the autopilot: doublets) go on: when is it announced, how far off
is the derivative that matters four seconds later, and which estimates are valid from then on, and far off? Then, hours
of unchanged flight with a doublet on each surface every minute, the autopilot holding attitude, in three flights; such
an hour without it, in flights of a minute; and flights in which not the aircraft changes but the air: is a change
announced?
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.estimation.judging import FAR, METHODS, Array, processes
from bench.estimation.simulated_flights import Setting, fly
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates
from sysid_node.sim.signals.dryden import INTENSITIES

AIRCRAFT = "cdrw"
KNOWN = {name: d.value for name, d in load_aircraft(AIRCRAFT).derivatives.items()}
ONSET, AFTER = 30.0, 4.0  # s
DEMANDED = 0.15  # of the derivative that matters, AFTER s after the ONSET
FLIGHT = 45.0  # s
TIMES = np.arange(20, round(FLIGHT * 4)) / 4  # s, at which estimates are looked at
WEATHERS = [(turbulence, autopilot) for turbulence in ("none", "light", "moderate") for autopilot in (False, True)]
HOUR, MINUTE, PAUSE = 3600.0, 60.0, 1.0  # s
HELD = (1, 2, 3)  # seeds of the flights that make up an hour on the autopilot
REPEATED = round(HOUR / len(HELD) / MINUTE) - 1  # the last doublet of a flight ends before the flight does
DOUBLETS = tuple(
    f"doublet:{surface}:amplitude={amplitude}:width=0.35:start={start}:every=60:repeat={REPEATED}"
    for surface, amplitude, start in (("elevator", 0.06, 10), ("aileron", 0.06, 25), ("rudder", 0.12, 40))
)


@dataclass(frozen=True)
class Change:
    """What derivatives become, as factors, and the one that matters most."""

    name: str
    factors: Mapping[str, float]
    key: str

    @property
    def truth(self) -> Array:
        """(D,) the derivatives afterwards."""
        return np.array([value * self.factors.get(name, 1.0) for name, value in KNOWN.items()])

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """For the simulator."""
        errors = {name: KNOWN[name] * (factor - 1.0) for name, factor in self.factors.items()}
        return {"derivative_error": errors}


def _surface(symbol: str, factor: float) -> dict[str, float]:
    return {name: factor for name in KNOWN if name.endswith(f"_{symbol}")}


#: Icing as severe as flown through: slopes lose a fifth, drag at no lift doubles.
ICING = dict.fromkeys(("CL_alpha", "CL_de", "Cm_alpha", "Cm_de", "Cl_p", "Cl_da", "Cl_beta", "Cn_r", "Cn_dr"), 0.8)
ICING |= {"CD_0": 2.0, "Cm_q": 0.9, "CY_beta": 0.7, "Cn_beta": 0.7}
CHANGES = (
    Change("elevator, half lost", _surface("de", 0.5), "Cm_de"),
    Change("elevator, 20 % lost", _surface("de", 0.8), "Cm_de"),
    Change("aileron, half lost", _surface("da", 0.5), "Cl_da"),
    Change("rudder, half lost", _surface("dr", 0.5), "Cn_dr"),
    # Cm_alpha gains CL_alpha, and Cm_de CL_de, times the way over the chord
    Change("CG 20 mm aft", {"Cm_alpha": 0.58, "Cm_de": 0.92}, "Cm_alpha"),
    Change("icing", ICING, "Cm_de"),
)


@dataclass(frozen=True)
class Seen:
    """Of one flight: when a change was announced (each time, s), and the D derivatives at K times."""

    announced: Array
    found: Array  # (K, D, 3) value, standard error, valid


def _seen(history: Sequence[Estimates]) -> Seen:
    times = np.array([e.time for e in history])
    said = np.array([any(d.status == "changed" for d in e.derivatives.values()) for e in history])
    rows = [[(d.value, d.standard_error, d.valid) for d in (e.derivatives[n] for n in KNOWN)] for e in history]
    return Seen(times[np.flatnonzero(said & ~np.roll(said, 1))], np.array(rows))


def watch(setting: Setting, method: str, times: Array, seeds: Sequence[int]) -> list[Seen]:
    """Each flight by itself."""
    batch, known = fly(AIRCRAFT, setting, seeds), load_aircraft(AIRCRAFT)
    return [_seen(run(known, METHODS[method].settings, batch.time, samples, times)) for samples in batch.samples]


def watch_on(setting: Setting, method: str, seeds: Sequence[int]) -> list[Seen]:
    """All flights one after the other, with a pause in between, as one record."""
    batch, known = fly(AIRCRAFT, setting, seeds), load_aircraft(AIRCRAFT)
    time = np.concatenate([batch.time + i * (setting.seconds + PAUSE) for i in range(len(seeds))])
    times = np.arange(1.0, time[-1], 0.5)
    return [_seen(run(known, METHODS[method].settings, time, np.concatenate(list(batch.samples)), times))]


def flown(setting: Setting, method: str, flights: int, pool: ProcessPoolExecutor) -> list[Seen]:
    """``watch`` over so many flights."""
    parts = [list(range(i + 1, min(i + 10, flights) + 1)) for i in range(0, flights, 10)]
    return [one for part in pool.map(partial(watch, setting, method, TIMES), parts) for one in part]


def changes(flights: int, method: str, pool: ProcessPoolExecutor) -> str:
    """The table of changes."""
    rows = []
    for change in CHANGES:
        for turbulence, autopilot in WEATHERS:
            setting = Setting("", turbulence, autopilot, seconds=FLIGHT, later=change.effects, onset=ONSET)
            rows.append(
                [f"{change.name}; {_weather(turbulence, autopilot)}", *_became(setting, change, method, flights, pool)]
            )
    heads = ("change; turbulence, loop", f"announced in {AFTER:g} s", f"in {FLIGHT - ONSET:g} s", "median, s", "before")
    tail = ("key derivative off, %", f"within {100 * DEMANDED:.0f} % or not valid", "valid", "> 4 s.e.")
    return table((*heads, *tail, "all valid ones later: > 4 s.e. %"), rows)


def _weather(turbulence: str, autopilot: bool) -> str:
    return f"{turbulence}, {'closed' if autopilot else 'open'}"


def _became(setting: Setting, change: Change, method: str, flights: int, pool: ProcessPoolExecutor) -> list[str]:
    """What became of one change in all flights."""
    seen = flown(setting, method, flights, pool)
    found = [min(s.announced[s.announced >= ONSET], default=math.inf) - ONSET for s in seen]
    value, error, valid = np.moveaxis(np.array([s.found for s in seen])[:, TIMES >= ONSET + AFTER], -1, 0)
    key = list(KNOWN).index(change.key)
    off = np.abs(value[:, 0, key] / change.truth[key] - 1.0)
    far = (np.abs(value - change.truth) > FAR * error) & (valid > 0)
    believed = valid[:, 0, key] > 0
    return [
        f"{np.count_nonzero(np.array(found) <= AFTER)} of {flights}",
        f"{np.count_nonzero(np.isfinite(found))}",
        f"{np.median(found):.1f}" if np.isfinite(np.median(found)) else "-",
        str(sum((s.announced < ONSET).any() for s in seen)),
        f"{100 * np.median(off):.0f}",
        f"{np.count_nonzero((off < DEMANDED) | ~believed)}",
        f"{np.count_nonzero(believed)}",
        f"{np.count_nonzero(far[:, 0, key])}",
        f"{100 * far.sum() / max(np.count_nonzero(valid), 1):.1f}",
    ]


def unchanged(flights: int, method: str, pool: ProcessPoolExecutor) -> str:
    """The table of flights in which nothing happens to the aircraft."""
    rows = []
    times = np.arange(1.0, HOUR / len(HELD), 0.5)
    for turbulence in ("none", "light", "moderate"):
        held = Setting("", turbulence, manoeuvre=DOUBLETS, seconds=HOUR / len(HELD))
        free = Setting("", turbulence, autopilot=False, seconds=MINUTE)
        closed = [pool.submit(watch, held, method, times, [seed]) for seed in HELD]
        opened = pool.submit(watch_on, free, method, range(1, round(HOUR / MINUTE) + 1))
        rows.append([f"{turbulence}, closed: an hour", *_falsely([one for done in closed for one in done.result()])])
        rows.append([f"{turbulence}, open: an hour", *_falsely(opened.result())])
    for before, after in (("light", "moderate"), ("moderate", "light")):
        for autopilot in (False, True):
            setting = Setting("", before, autopilot, seconds=FLIGHT, onset=ONSET)
            setting = replace(setting, later={"turbulence": {"intensity": INTENSITIES[after]}})
            label = f"{before}, from {ONSET:g} s on {after}, {'closed' if autopilot else 'open'}: {flights} flights"
            rows.append([label, *_falsely(flown(setting, method, flights, pool))])
    return table(("turbulence, loop", "changes announced", "estimates valid, %", "valid ones > 4 s.e., %"), rows)


def _falsely(seen: Sequence[Seen]) -> list[str]:
    truth = np.array(list(KNOWN.values()))
    value, error, valid = np.moveaxis(np.concatenate([s.found for s in seen]), -1, 0)
    far = (np.abs(value - truth) > FAR * error) & (valid > 0)
    share = 100 * far.sum() / max(np.count_nonzero(valid), 1)
    return [str(sum(s.announced.size for s in seen)), f"{100 * valid.mean():.0f}", f"{share:.1f}"]


TABLES = {"changed": changes, "unchanged": unchanged}


def main() -> None:
    """Print the tables, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=20, help="a change and weather (default: 20)")
    parser.add_argument("--method", choices=METHODS, default=OnlineSettings().method)
    parser.add_argument("--only", choices=TABLES, help="one table")
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    with processes() as pool:
        for name, measure in TABLES.items():
            if args.only in (None, name):
                text = measure(args.flights, args.method, pool)
                publish(f"bench/estimation/changes.py {name}", text, args.page)


if __name__ == "__main__":
    main()
