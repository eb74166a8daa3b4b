"""What is lost where an aircraft records commands and is a little off, beside exact positions of a perfect one.

    python -m bench.estimation.commands_only [--flights 8] [--page docs/results/commands_only.md]

Each flight is flown twice in the same air: once by the aircraft of the file, whose surfaces move without steps, with
positions measured at 200 Hz and an aircraft file that is `ideal`; once with all imperfections of `all_imperfections`
drawn together, recording commands alone. Of the servos the file is right within its tolerances. Three questions: when
is a derivative valid for the first time; after half the elevator was lost, when is `Cm_de` right again, and is the
change announced; and what is left without vanes?
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.estimation.all_imperfections import COMMAND_RATE, RATE, Effects, drawn, known
from bench.pages import publish, table
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.streams import Streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import DerivativeEstimate, Estimates
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

AIRCRAFT, AIRS = "cdrw", ("none", "light", "moderate")
MANOEUVRES = {"3-2-1-1": "3211:repeat=3", "multisine": "multisine:every=22:repeat=2"}
OFTEN = "3211:every=12:repeat=5"  # the elevator moves at 37 s
AIR_ANGLES = slice(1, 3)  # of the air data
ONSET, WITHIN = 36.0, 0.15  # s; share of `Cm_de`
STEP = 0.5  # s between looks at the estimates
LOST: Effects = {"control_effectiveness_loss": {"elevator": 0.5, "onset": ONSET}}


@dataclass(frozen=True)
class Flight:
    """The estimates along a flight, and the true derivatives before any change."""

    history: Sequence[Estimates]
    truth: Mapping[str, float]

    def first_valid(self) -> list[float]:
        """(D,) s from which on each derivative is valid until the end; infinite where it is not valid at the end."""
        times = [e.time for e in self.history]
        found = []
        for name in self.truth:
            valid = np.array([e.derivatives[name].valid for e in self.history])
            stays = np.flip(np.logical_and.accumulate(np.flip(valid)))
            found.append(times[int(np.argmax(stays))] if stays.any() else math.inf)
        return found

    def holding(self) -> tuple[int, int]:
        """How many derivatives are valid at the end, and how many intervals of these hold the truth."""
        valid = [d for d in self.history[-1].derivatives.values() if d.valid]
        return len(valid), sum(d.lower <= self.truth[d.name] <= d.upper for d in valid)

    def announced(self) -> list[float]:
        """s at which a change of the aircraft was announced."""
        said = [any(d.status == "changed" for d in e.derivatives.values()) for e in self.history]
        return [
            e.time for e, now, before in zip(self.history, said, [False, *said], strict=False) if now and not before
        ]


class Pair:
    """Both ways of one flight."""

    def __init__(self, number: int, air: str, vanes: bool = True) -> None:
        self.number, self.air, self.vanes = number, air, vanes
        self.aircraft = load_aircraft(AIRCRAFT)
        self.simulator = Simulator(self.aircraft, RATE)

    def exact(self, manoeuvre: str, later: Effects) -> Flight:
        """Positions of a perfect aircraft."""
        bias = dict.fromkeys(self.aircraft.noise_bias, 0.0)
        ideal = replace(self.aircraft, ideal=True, noise_bias=bias)
        return self._flown(
            ideal, manoeuvre, later, FlightSampler(actuator_rate=200.0, surfaces="measured"), "positions"
        )

    def ordinary(self, manoeuvre: str, later: Effects) -> Flight:
        """Commands of an aircraft with everything a little off."""
        kind, effects = drawn(self.aircraft, self.number)
        file = known(self.aircraft, {**kind, "file": "wrong"}, effects, self.number)
        return self._flown(file, manoeuvre, {**effects, **later}, FlightSampler(), "auto")

    def _flown(self, file: Aircraft, manoeuvre: str, effects: Effects, recorder: FlightSampler, carried: str) -> Flight:
        rate = None if carried == "positions" else COMMAND_RATE
        plan = parse_manoeuvre(manoeuvre, self.aircraft, RATE)
        moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
        conditions = SortieConditions(effects, turbulence=self.air, seed=self.number, command_rate=rate)
        sortie = fly_sortie(self.simulator, moves, conditions)
        return Flight(_estimates(file, self._without(recorder.record(sortie)), carried), sortie.derivatives)

    def _without(self, streams: Streams) -> Streams:
        if self.vanes:
            return streams
        values = streams.air_data.values.copy()
        values[:, AIR_ANGLES] = np.nan
        return replace(streams, air_data=replace(streams.air_data, values=values))


def _estimates(aircraft: Aircraft, streams: Streams, carried: str) -> list[Estimates]:
    settings = OnlineSettings(actuators=carried)
    aligned = align_streams(aircraft, streams, settings.max_gap, carried)
    times = np.arange(aligned.time[0] + STEP, aligned.time[-1], STEP)
    return run(aircraft, settings, aligned.time, aligned.samples, times, commands_from=aligned.commands_from)


def _beside(exact: float, ordinary: float, unit: str = "") -> str:
    """Both numbers of a cell."""
    return " / ".join("-" if math.isinf(x) or math.isnan(x) else f"{x:.1f}{unit}" for x in (exact, ordinary))


def _median(flights: Sequence[Sequence[float]]) -> list[float]:
    return [float(x) for x in np.median(np.array(flights), axis=0)]


def convergence(numbers: Sequence[int]) -> str:
    """When each derivative is valid for good: median over flights, by manoeuvre and air."""
    columns, heads = [], []
    for name, manoeuvre in MANOEUVRES.items():
        for air in AIRS:
            pairs = [Pair(number, air) for number in numbers]
            both = [[one.exact(manoeuvre, {}) for one in pairs], [one.ordinary(manoeuvre, {}) for one in pairs]]
            exact, ordinary = (_median([flight.first_valid() for flight in each]) for each in both)
            columns.append([_beside(a, b) for a, b in zip(exact, ordinary, strict=True)])
            counts = [np.array([flight.holding() for flight in each]).sum(axis=0) for each in both]
            columns[-1] += [
                _beside(*(count[0] / len(numbers) for count in counts)),
                _beside(*(100.0 * count[1] / max(count[0], 1) for count in counts), unit=" %"),
            ]
            heads.append(f"{name}, {air}")
    names = [*load_aircraft(AIRCRAFT).derivatives, "**valid at the end**", "**of these hold**"]
    return table(("s, positions / commands", *heads), [list(row) for row in zip(names, *columns, strict=True)])


def loss(numbers: Sequence[int]) -> str:
    """After half the elevator was lost: when it is announced, and when `Cm_de` is valid and right."""
    rows = []
    for air in AIRS:
        pairs = [Pair(100 + number, air) for number in numbers]
        for what, fly in (("positions", Pair.exact), ("commands", Pair.ordinary)):
            flown = [fly(pair, OFTEN, LOST) for pair in pairs]
            said = [min((t for t in one.announced() if t >= ONSET), default=math.inf) - ONSET for one in flown]
            early = sum(any(t < ONSET for t in one.announced()) for one in flown)
            right = [_right_again(one) for one in flown]
            valid, wrong = np.array([_at_the_end(one) for one in flown]).sum(axis=0)
            found = [f"{np.count_nonzero(np.isfinite(x))} of {len(numbers)}" for x in (said, right)]
            times = ["-" if math.isinf(np.median(x)) else f"{np.median(x):.1f}" for x in (said, right)]
            rows.append([f"{air}: {what}", found[0], times[0], str(early), found[1], times[1], str(valid), str(wrong)])
    heads = (
        "air",
        "announced",
        "after, s",
        "before the loss",
        "`Cm_de` right again",
        "after, s",
        "valid at the end",
        "of these wrong",
    )
    return table(heads, rows)


def _cm_de(flight: Flight) -> list[tuple[float, DerivativeEstimate]]:
    """Estimates of `Cm_de` from the loss on, with s since."""
    return [(e.time - ONSET, e.derivatives["Cm_de"]) for e in flight.history if e.time >= ONSET]


def _right_again(flight: Flight) -> float:
    """s after the loss when `Cm_de` is valid and within the demanded share of what is left; infinite: never."""
    after = 0.5 * flight.truth["Cm_de"]
    return next((t for t, d in _cm_de(flight) if d.valid and abs(d.value / after - 1.0) < WITHIN), math.inf)


def _at_the_end(flight: Flight) -> tuple[bool, bool]:
    """Whether `Cm_de` is valid at the end, and whether it is so with an interval that does not hold what is left."""
    _, last = _cm_de(flight)[-1]
    return last.valid, last.valid and not last.lower <= 0.5 * flight.truth["Cm_de"] <= last.upper


def no_vanes(numbers: Sequence[int]) -> str:
    """What is valid at the end, and holds, without vanes."""
    rows = []
    for air in AIRS[:2]:
        cells = [air]
        for fly in (Pair.exact, Pair.ordinary):
            flown = [fly(Pair(number, air, vanes=False), MANOEUVRES["3-2-1-1"], {}) for number in numbers]
            valid, hold = np.array([one.holding() for one in flown]).sum(axis=0)
            cells += [f"{valid / len(numbers):.1f}", f"{100 * hold / valid:.0f} %" if valid else "-"]
        rows.append(cells)
    return table(("air, no vanes", "positions: valid", "hold", "commands: valid", "hold"), rows)


def main() -> None:
    """Print the tables, or put them in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=8, help="in each setting (default: 8)")
    parser.add_argument("--first", type=int, default=1, help="number of the first (default: 1)")
    parser.add_argument("--only", choices=TABLES, help="one table")
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    for name, make in TABLES.items():
        if args.only in (None, name):
            text = f"{args.flights} flights in each setting.\n\n{make(range(args.first, args.first + args.flights))}"
            publish(f"bench/estimation/commands_only.py {name}", text, args.page)


TABLES = {"convergence": convergence, "loss": loss, "no_vanes": no_vanes}

if __name__ == "__main__":
    main()
