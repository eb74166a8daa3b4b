"""Whether intervals hold where an autopilot answers gusts as PX4 and ArduPilot do, or with stiffer loops.

    python -m bench.estimation.stiff_autopilots --page docs/results/intervals.md

Flights of two minutes in light and moderate turbulence, with manoeuvres on top of the autopilot's commands: the
simulator's own with up to eight times its gains, and those of others. The file is exact and the surfaces are measured,
so that nothing but the loops may move an estimate. Of all aircraft, airs and seeds of a row: how many derivatives are
valid, how many of their 95 % intervals hold, and how many estimates are far off.
"""

from __future__ import annotations

import argparse
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from bench.estimation.answering_surfaces import doublets, judged, multisines
from bench.estimation.judging import exact, processes
from bench.estimation.simulated_flights import Setting, fly
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.online.replay import run_to_end
from sysid_node.online.settings import OnlineSettings
from sysid_node.sim.flying.attitude_loops import ARDUPILOT, PX4, AttitudeLoops, RateLoop

AIRCRAFT, AIRS = ("cdrw", "cdfp", "kestrel"), ("light", "moderate")
SECONDS = 120.0

Counts = tuple[int, int, int, int]
Loops = tuple[AttitudeLoops | None, float]  # none: the simulator's own; times their gains

#: With the least time constant that ArduPilot recommends, and a rate that is answered as much as a demand.
TIGHT = AttitudeLoops("tight", 0.4, RateLoop(1.0, 0.43), RateLoop(1.0, 0.39))

AUTOPILOTS: dict[str, Loops] = {
    **{f"own gains x {factor:g}": (None, factor) for factor in (1.0, 2.0, 4.0, 8.0)},
    **{loops.name: (loops, 1.0) for loops in (PX4, ARDUPILOT, TIGHT)},
}

MANOEUVRES = {
    "3-2-1-1s": (),
    "multisines": multisines(1.0, SECONDS),
    "doublets every 20 s": doublets(20.0, SECONDS),
}


def counted(autopilot: str, manoeuvre: str, seeds: list[int], flown: tuple[str, str]) -> Counts | None:
    """Derivatives, those valid, those of these that hold, and those far off, of some flights; None: they diverge."""
    aircraft, air = flown
    known = exact(load_aircraft(aircraft))
    loops, factor = AUTOPILOTS[autopilot]
    setting = Setting("", air, stiffness=factor, loops=loops, seconds=SECONDS, manoeuvre=MANOEUVRES[manoeuvre])
    try:
        batch = fly(aircraft, setting, seeds)
    except InputError:
        return None
    ends = [run_to_end(known, OnlineSettings(), batch.time, one, batch.time[-1:])[0][-1] for one in batch.samples]
    count, valid, hold, far = np.sum([judged(known, end) for end in ends], axis=0).tolist()
    return count, valid, hold, far


def row(manoeuvre: str, autopilot: str, found: list[Counts]) -> list[str]:
    """Of flights that did not diverge."""
    count, valid, hold, far = np.sum(found, axis=0)
    shares = (valid / count, hold / max(valid, 1), far / max(valid, 1))
    return [manoeuvre, autopilot, str(len(found)), *(f"{100.0 * share:.1f} %" for share in shares)]


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=11, help="seed of the first flight (default: 11)")
    parser.add_argument("--flights", type=int, default=3, help="in each setting (default: 3)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    seeds, rows = list(range(args.first, args.first + args.flights)), []
    with processes() as pool:
        for manoeuvre, autopilot in product(MANOEUVRES, AUTOPILOTS):
            work = partial(counted, autopilot, manoeuvre, seeds)
            found = [counts for counts in pool.map(work, product(AIRCRAFT, AIRS)) if counts is not None]
            rows.append(row(manoeuvre, autopilot, found))
            print(*rows[-1], flush=True)
    heads = ("manoeuvres", "autopilot", "aircraft and airs", "valid", "hold", "> 4 s.e.")
    publish("bench/estimation/stiff_autopilots.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
