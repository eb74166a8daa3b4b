"""Which faults are found, how soon, and what is taken for one.

    python -m bench.estimation.faults --page docs/results/faults.md

`cdrw` under an autopilot that holds attitude and airspeed, with 3-2-1-1s every six seconds; something fails at 40 s.
The monitor knows the aircraft from a file whose derivatives are off by draws from their tolerances; `--identified` has
it know them to 2 %, as from an identifier. Surfaces are commands (`actuators` echoes them): no servo tells its
position. Missed is what raises no alarm within 15 s, wrongly isolated what 5 s after its alarm is given another name.
`--power` has faults grow from small to large and counts how many of them are found within which time.
`--hours 4` flies hours in which nothing fails, half of them with 3-2-1-1s, half with a doublet a minute on each
surface, and counts alarms, in every turbulence or in those that are named. With `--with-identifier` an online estimator
identifies the same samples, as commands, and the monitor takes its estimates, as beside the node. Results are kept in
files as they come; those that are there are not flown again, and the table sums up all of them.
"""

from __future__ import annotations

import argparse
import json
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.estimation.simulated_flights import Effects, Setting, fly
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.faults import monitor
from sysid_node.faults.model.blocks import of_record
from sysid_node.faults.model.reference_model import identifier_estimates
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.state import MonitorState
from sysid_node.faults.types import (
    AIRSPEED,
    DAMAGE,
    HARD_OVER,
    LOSS,
    STUCK,
    VANE_OFFSET,
    VANE_STUCK,
)
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates

Array = NDArray[np.float64]
Break = Callable[[Array, Array, np.random.Generator], None]  # samples (N, M) from the onset on, the last one before

NAME = "cdrw"
AIRCRAFT = load_aircraft(NAME)
KNOWN = {name: derivative.value for name, derivative in AIRCRAFT.derivatives.items()}
WEATHERS = ("none", "light", "moderate")
BOUNDS = (WEATHERS[0], WEATHERS[-1])  # of the table of faults: light turbulence lies between
ONSET, END, JUDGED = 40.0, 55.0, 5.0  # s: failure, end of a flight, from an alarm until the isolation is judged
HOUR, PART = 3600.0, 600.0  # s
KNOWN_TO = 0.02  # share to which an identifier knows the derivatives
IDENTIFIED, BESIDE = "identified", "with-identifier"  # how the monitor comes to know the derivatives; else by the file
DOUBLETS = tuple(
    f"doublet:{surface}:amplitude={amplitude}:width=0.35:start={start}:every=60:repeat={int(PART / 60) - 1}"
    for surface, amplitude, start in (("elevator", 0.06, 10), ("aileron", 0.06, 25), ("rudder", 0.12, 40))
)
SYMBOLS = {"elevator": "de", "aileron": "da", "rudder": "dr"}


@dataclass(frozen=True)
class Case:
    """A fault: what it does to the aircraft or to the samples, and what it should be called."""

    name: str
    kinds: Sequence[str]
    part: str
    size: float = math.nan
    effects: Effects = field(default_factory=dict)
    broken: Break | None = None


def _lost(surface: str, share: float) -> Case:
    effects = {"control_effectiveness_loss": {surface: share}}
    return Case(f"{surface}, {100 * share:.0f} % of its effect lost", (LOSS,), surface, share, effects)


def _stuck(surface: str, angle: float) -> Case:
    """All effect lost, and the moments of the angle as a constant: the same forces, while commands go on."""
    symbol = SYMBOLS[surface]
    moments = {c: KNOWN.get(f"{c}_{symbol}", 0.0) * angle for c in ("CL", "CD", "Cm", "CY", "Cl", "Cn")}
    effects: dict[str, Mapping[str, float]] = {"control_effectiveness_loss": {surface: 1.0}}
    if symbol == "de":
        effects["derivative_error"] = {f"{c}_0": moments[c] for c in ("CL", "CD", "Cm")}
    else:
        effects["lateral_asymmetry"] = {f"{c}_0": moments[c] for c in ("CY", "Cl", "Cn")}
    return Case(f"{surface} stuck at {math.degrees(angle):+.0f} deg", (STUCK, HARD_OVER), surface, angle, effects)


def _jammed(column: str, noise: float) -> Break:
    """From the onset on a sensor reads what it read last, with its noise."""
    at = SAMPLE_COLUMNS.index(column)

    def broken(after: Array, last: Array, random: np.random.Generator) -> None:
        after[:, at] = last[at] + noise * random.standard_normal(len(after))

    return broken


def _changed(**factors: float) -> Effects:
    return {"derivative_error": {name: KNOWN[name] * (factor - 1.0) for name, factor in factors.items()}}


def _vane(angle: str, degrees: float) -> Case:
    size = math.radians(degrees)
    return Case(f"{angle} vane off by {degrees:g} deg", (VANE_OFFSET,), angle, size, {"vane_bias": {angle: size}})


def _airspeed(error: float) -> Case:
    effects = {"airspeed_scale": {"error": error}}
    return Case(f"airspeed reads {100 * error:+.0f} %", (AIRSPEED,), "airspeed", error, effects)


FIN = dict.fromkeys(("CY_beta", "Cn_beta", "Cn_r", "CY_r", "Cn_dr", "CY_dr"), 0.5)
CASES = (
    *(_lost("elevator", share) for share in (0.2, 0.4, 0.6)),
    *(_lost("aileron", share) for share in (0.3, 0.6)),
    *(_lost("rudder", share) for share in (0.2, 0.5)),
    *(_stuck("elevator", 0.05), _stuck("aileron", 0.05), _stuck("rudder", 0.1)),
    *(_airspeed(error) for error in (-0.1, -0.3)),
    Case("pitot blocked: airspeed stays", (AIRSPEED,), "airspeed", broken=_jammed("V", AIRCRAFT.noise["airspeed"])),
    *(_vane("alpha", degrees) for degrees in (1.0, 3.0)),
    *(_vane("beta", degrees) for degrees in (1.0, 3.0)),
    Case("alpha vane stuck", (VANE_STUCK,), "alpha", broken=_jammed("alpha", AIRCRAFT.noise["alpha"])),
    Case("beta vane stuck", (VANE_STUCK,), "beta", broken=_jammed("beta", AIRCRAFT.noise["beta"])),
    Case("CG 20 mm aft", (DAMAGE,), "longitudinal", effects={"cg_shift": {"x": -0.02}}),
    Case("pitch damping halved", (DAMAGE,), "longitudinal", effects=_changed(Cm_q=0.5)),
    Case("half the fin lost", (DAMAGE,), "lateral", effects=_changed(**FIN)),
)


def _aft(millimetres: float) -> Case:
    effects = {"cg_shift": {"x": -1e-3 * millimetres}}
    return Case(f"CG {millimetres:g} mm aft", (DAMAGE,), "longitudinal", effects=effects)


def _undamped(share: float) -> Case:
    return Case(
        f"pitch damping {100 * share:.0f} % less", (DAMAGE,), "longitudinal", effects=_changed(Cm_q=1.0 - share)
    )


#: Each fault from hardly to easily found.
GROWING = (
    *(_lost("elevator", share) for share in (0.1, 0.2, 0.3, 0.4)),
    *(_lost("aileron", share) for share in (0.1, 0.2, 0.3, 0.45, 0.6)),
    *(_vane("beta", degrees) for degrees in (0.5, 1.0, 2.0, 3.0)),
    *(_aft(millimetres) for millimetres in (5.0, 10.0, 20.0, 30.0)),
    *(_undamped(share) for share in (0.25, 0.5, 0.75)),
)
WITHIN = (5.0, 15.0, 40.0)  # s


def believed(seed: int) -> Aircraft:
    """The aircraft file, off by draws from its tolerances."""
    random = np.random.default_rng(1000 + seed)
    drawn = {
        name: replace(d, value=d.value + (d.tolerance or 0.0) * float(random.standard_normal()))
        for name, d in AIRCRAFT.derivatives.items()
    }
    return replace(AIRCRAFT, derivatives=drawn)


def monitored(seed: int, identified: bool) -> MonitorState:
    """A monitor that has seen nothing."""
    if not identified:
        return monitor.init(believed(seed), FaultMonitorSettings())
    state = monitor.init(AIRCRAFT, FaultMonitorSettings())
    off = np.random.default_rng(2000 + seed).standard_normal(len(state.reference.values))
    state.reference.errors = KNOWN_TO * np.abs(state.reference.values) + 1e-5
    state.reference.values = state.reference.values + state.reference.errors * off
    return state


@dataclass(frozen=True)
class Seen:
    """Of one flight: alarms before the onset, when the first one after it came, what was named at last."""

    early: int
    after: float  # s, inf = never
    kind: str = ""
    part: str = ""
    size: float = math.nan
    lower: float = math.nan
    upper: float = math.nan
    unit: str = ""

    @property
    def found(self) -> bool:
        """Whether there was an alarm."""
        return math.isfinite(self.after)

    def names(self, case: Case) -> bool:
        """Whether it was called what it is."""
        return self.found and self.kind in case.kinds and self.part == case.part


def estimated(aircraft: Aircraft, time: Array, samples: Array) -> Iterator[Estimates]:
    """What an online estimator says of a flight, once a second."""
    seconds = np.arange(1.0, float(time[-1]))
    yield from run(aircraft, OnlineSettings(), time, samples, seconds, commands_from=0)


def watch(state: MonitorState, time: Array, samples: Array, onset: float, estimates: Iterable[Estimates] = ()) -> Seen:
    """Let the monitor judge a flight, which takes the ``estimates`` when they are made."""
    early, found, named = 0, math.inf, None
    coming = deque(estimates)
    for block in of_record(state.aircraft, time, samples):
        while coming and coming[0].time <= block.time:
            made = coming.popleft()
            known = identifier_estimates(made.derivatives.values(), made.servos.values())
            monitor.receive_estimates(state, made.time, known)
        before = state.alarm
        monitor.take(state, block)
        if state.alarm is not None and before is None:
            if block.time < onset:
                early += 1
            elif not math.isfinite(found):
                found = block.time
        if state.fault is not None and block.time >= onset and block.time <= found + JUDGED:
            named = state.fault
    said = (named.kind, named.part, named.size, named.lower, named.upper, named.unit) if named is not None else ()
    return Seen(early, found - onset, *said)


def watched(case: Case, turbulence: str, seeds: Sequence[int], knowledge: str, end: float) -> list[Seen]:
    """What the monitor sees in flights of ``end`` s."""
    setting = Setting("", turbulence, seconds=end, later=case.effects, onset=ONSET)
    if not case.effects:
        setting = replace(setting, onset=math.inf)
    batch = fly(NAME, setting, seeds)
    seen = []
    for seed, samples in zip(seeds, batch.samples, strict=True):
        if case.broken is not None:
            first = int(np.searchsorted(batch.time, ONSET))
            case.broken(samples[first:], samples[first - 1], np.random.default_rng(seed))
        state = monitored(seed, identified=knowledge == IDENTIFIED)
        estimates = estimated(state.aircraft, batch.time, samples) if knowledge == BESIDE else ()
        seen.append(watch(state, batch.time, samples, ONSET, estimates))
    return seen


@dataclass(frozen=True)
class Series:
    """So many flights of each fault; those that are in the file of results are not flown again."""

    flights: int
    knowledge: str  # what the monitor knows of the derivatives: one of the flags' names, or none
    end: float  # s
    results: Path

    def of(self, case: Case, turbulence: str) -> list[Seen]:
        """What the monitor saw in each of the flights."""
        this = {"fault": case.name, "turbulence": turbulence}
        seen = {one["seed"]: Seen(**one["seen"]) for one in _kept(self.results) if this.items() <= one.items()}
        seeds = [seed for seed in range(1, self.flights + 1) if seed not in seen]
        if seeds:
            seen |= zip(seeds, watched(case, turbulence, seeds, self.knowledge, self.end), strict=True)
        for seed in seeds:
            _keep(self.results, {**this, "seed": seed, "seen": asdict(seen[seed])})
        return [seen[seed] for seed in range(1, self.flights + 1)]


def power(series: Series) -> str:
    """How many faults of which size are found within which time."""
    rows = []
    for case in GROWING:
        seen = [series.of(case, turbulence) for turbulence in BOUNDS]
        counts = [sum(one.after <= within for one in flights) for flights in seen for within in WITHIN]
        rows.append([case.name, *map(str, counts)])
    heads = [f"{turbulence}: {within:g} s" for turbulence in BOUNDS for within in WITHIN]
    return table((f"found of {series.flights} within; turbulence", *heads), rows)


def row(case: Case, turbulence: str, seen: Sequence[Seen]) -> list[str]:
    """One line of the table."""
    found = [one for one in seen if one.found]
    after = sorted(one.after for one in found)
    times = [f"{np.median(after):.1f}", f"{after[-1]:.1f}"] if after else ["-", "-"]
    return [
        f"{case.name}; {turbulence}",
        str(len(found)),
        *times,
        str(sum(one.names(case) for one in found)),
        *_sizes(case, [one for one in found if one.names(case)]),
        str(sum(one.early for one in seen)),
    ]


def _sizes(case: Case, found: Sequence[Seen]) -> list[str]:
    """Median size, and how many intervals hold the true one."""
    if math.isnan(case.size) or not found:
        return ["-", "-"]
    middle = float(np.median([one.size for one in found]))
    inside = sum(one.lower <= case.size <= one.upper for one in found)
    said = f"{math.degrees(middle):+.1f} deg" if found[0].unit == "rad" else f"{100 * middle:.0f} %"
    return [said, f"{inside} of {len(found)}"]


def faults(series: Series) -> str:
    """The table of faults."""
    rows = [row(case, turbulence, series.of(case, turbulence)) for case in CASES for turbulence in BOUNDS]
    heads = (f"fault; turbulence: {series.flights} flights", "found", "after s: median", "longest", "named rightly")
    return table((*heads, "size, median", "true size in the interval", "alarms before"), rows) + _shares(series.flights)


def _shares(flights: int) -> str:
    """Which shares a count of flights may stand for: Clopper & Pearson, Biometrika 26 (1934)."""
    from scipy.stats import binomtest  # noqa: PLC0415  # only here

    bounds = [(n, binomtest(n, flights).proportion_ci(0.95)) for n in range(flights, -1, -1)]
    said = (f"{n}: {100 * share.low:.0f} to {100 * share.high:.0f} %" for n, share in bounds)
    return f"\n\nWhat a count out of {flights} says of the share (95 %): {'; '.join(said)}."


def _kept(results: Path) -> list[Any]:
    """What a file of results holds."""
    return [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []


def _keep(results: Path, one: object) -> None:
    results.parent.mkdir(parents=True, exist_ok=True)
    with results.open("a", encoding="utf-8") as file:
        file.write(json.dumps(one) + "\n")


def hours(count: float, weathers: Sequence[str], first: int, results: Path, knowledge: str) -> str:
    """Fly hours in which nothing fails, those that are not yet in the file of results, and count alarms.

    Half of the flights are with derivatives known to 2 %, unless an identifier flies along.
    """
    known = _kept(results)
    done = {(one["turbulence"], one["seed"]) for one in known}
    for seed in range(first, first + round(count * HOUR / PART)):
        for turbulence in weathers:
            if (turbulence, seed) in done:
                continue
            setting = Setting("", turbulence, seconds=PART, manoeuvre=DOUBLETS if seed % 2 else ())
            batch = fly(NAME, setting, [seed])
            samples = batch.samples[0]
            state = monitored(seed, identified=knowledge != BESIDE and seed % 4 < 2)
            estimates = estimated(state.aircraft, batch.time, samples) if knowledge == BESIDE else ()
            seen = watch(state, batch.time, samples, math.inf, estimates)
            known.append({"turbulence": turbulence, "seed": seed, "alarms": seen.early})
            _keep(results, known[-1])
    rows = []
    for turbulence in WEATHERS:
        mine = [one["alarms"] for one in known if one["turbulence"] == turbulence]
        if not mine:
            continue
        flown = len(mine) * PART / HOUR
        rows.append([turbulence, f"{flown:.1f}", str(sum(mine)), f"{_most(sum(mine)) / flown:.2f}"])
    flown, alarms = sum(float(r[1]) for r in rows), sum(int(r[2]) for r in rows)
    if len(rows) > 1:
        rows.append(["all", f"{flown:.1f}", str(alarms), f"{_most(alarms) / flown:.2f}"])
    return table(("turbulence", "hours", "false alarms", "an hour, 95 % sure: less than"), rows)


def _most(count: int) -> float:
    """The rate that so many events or fewer have a chance of 5 % with (Poisson)."""
    from scipy.stats import chi2  # noqa: PLC0415  # only here

    return 0.5 * float(chi2.ppf(0.95, 2 * count + 2))


def main() -> None:
    """Print the table, or put it in the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=10, help="of each fault and turbulence (default: 10)")
    known = parser.add_mutually_exclusive_group()
    for flag, words in ((IDENTIFIED, "derivatives known to 2 %% instead"), (BESIDE, "beside an online estimator")):
        known.add_argument(f"--{flag}", dest="knowledge", action="store_const", const=flag, default="", help=words)
    parser.add_argument("--hours", type=float, default=0.0, help="fly so many in each turbulence without a fault")
    parser.add_argument("--weathers", nargs="+", choices=WEATHERS, default=WEATHERS, help="of the hours (default: all)")
    parser.add_argument("--first", type=int, default=1, help="seed of the hours' first flight (default: 1)")
    parser.add_argument("--power", action="store_true", help="count what is found by size and time instead")
    parser.add_argument("--results", type=Path, default=Path("out/faults"), help="folder (default: out/faults)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    what = "hours" if args.hours else "power" if args.power else "faults"
    mode = f" --{args.knowledge}" if args.knowledge else ""
    kept = args.results / f"{what}{mode.replace(' --', '_').replace('-', '_')}.jsonl"
    flag = "" if what == "faults" else f" --{what}"
    if args.hours:
        done = hours(args.hours, args.weathers, args.first, kept, args.knowledge)
    else:
        series = Series(args.flights, args.knowledge, ONSET + WITHIN[-1] if args.power else END, kept)
        done = power(series) if args.power else faults(series)
    publish(f"bench/estimation/faults.py{flag}{mode}", done, args.page)


if __name__ == "__main__":
    main()
