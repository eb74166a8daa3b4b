"""Whether the fault monitor names a servo that becomes slower in flight, where only commands are recorded.

    python -m bench.estimation.slow_servos [--flights 3] [--first 1] [--page docs/results/faults.md]

The plant is written apart from the package (`bench/withheld/plants`). An autopilot holds `cdrw` while 3-2-1-1s move one
surface after the other; the servos are of second order at 8 Hz. At 40 s of 80 s a further lag of first order comes into
one servo, or half of the elevator's effect is lost, or nothing happens. The aircraft file says nothing of servos and is
off by its tolerances.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.estimation.servo_flights import flown
from bench.pages import publish, table
from bench.withheld.plants.motion import Effects
from sysid_node.faults.model.reference_model import identifier_estimates
from sysid_node.faults.recorded_flight import Episode, RecordedEstimates, judge
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import SLOWER
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings

ONSET, PERIOD = 40.0, 0.5  # s: the change, between estimates
MANOEUVRES = tuple(f"3211:{name}:start={2 + 6 * i}" for i, name in enumerate(("elevator", "aileron", "rudder") * 4))
AIRS = ("none", "light")


@dataclass(frozen=True)
class Case:
    """What happens at the onset; ``slower`` s is the added lag of the control ``part``."""

    words: str
    effects: Effects
    part: str = ""
    slower: float = 0.0


def _slower(part: str, late: float) -> Case:
    return Case(f"{part}: {late:g} s slower", {"servo_slows": {part: late, "onset": ONSET}}, part, late)


CASES = (
    Case("nothing", {}),
    Case("half of the elevator lost", {"control_effectiveness_loss": {"elevator": 0.5, "onset": ONSET}}),
    _slower("elevator", 0.04),
    _slower("elevator", 0.08),
    _slower("aileron", 0.08),
    _slower("rudder", 0.12),
)


def watched(case: Case, air: str, seed: int) -> list[Episode]:
    """The faults that the replay of one flight reports."""
    file, streams = flown(MANOEUVRES, case.effects, air, seed)
    settings = OnlineSettings(actuators="commands")
    aligned = align_streams(file, streams, settings.max_gap, settings.actuators)
    due = np.arange(PERIOD, aligned.time[-1] - PERIOD, PERIOD)
    history = run(file, settings, aligned.time, aligned.samples, due, commands_from=aligned.commands_from)
    stamps = aligned.stamps[np.searchsorted(aligned.time, due)].tolist()
    heard = [
        RecordedEstimates(stamp, identifier_estimates(e.derivatives.values(), e.servos.values()))
        for stamp, e in zip(stamps, history, strict=True)
    ]
    return list(judge(file, FaultMonitorSettings(), streams, (), heard).episodes)


def row(case: Case, air: str, flights: Sequence[list[Episode]]) -> list[str]:
    """One line of the table."""
    slower = [[e.fault for e in flight if e.fault.kind == SLOWER] for flight in flights]
    right = [mine for faults in slower if (mine := [fault for fault in faults if fault.part == case.part])]
    wrong = sum(fault.part != case.part for faults in slower for fault in faults)
    last = [mine[-1] for mine in right]
    holds = sum(fault.lower <= case.slower <= fault.upper for fault in last)
    late = f"{np.median([mine[0].found - ONSET for mine in right]):.1f}" if right else "-"
    size = f"{np.median([fault.size for fault in last]):.3f}" if right else "-"
    named = f"{len(right)} of {len(flights)}" if case.part else "-"
    words = [e.fault.kind for flight in flights for e in flight if e.fault.kind != SLOWER]
    others = ", ".join(f"{kind} {words.count(kind)}" for kind in dict.fromkeys(words)) or "-"
    return [f"{case.words}; {air}", named, late, size, f"{holds} of {len(right)}" if right else "-", str(wrong), others]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=3, help="of each case, in each air")
    parser.add_argument("--first", type=int, default=1, help="number of the first flight")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    rows = []
    for case in CASES:
        for air in AIRS:
            rows.append(
                row(case, air, [watched(case, air, seed) for seed in range(args.first, args.first + args.flights)])
            )
            print(*rows[-1], sep=" | ", flush=True)
    heads = ("what happens; turbulence", "servo named", "after s: median", "slower by s: median")
    heads += ("true one in the interval", "another servo named", "other faults named")
    publish("bench/estimation/slow_servos.py", table(heads, rows), args.page)


if __name__ == "__main__":
    main()
