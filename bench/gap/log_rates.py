"""Which causes ``sysid gap`` names at the rates of autopilots' logs.

    python -m bench.gap.log_rates --page docs/results/log_rates.md

Flights of ``cdrw`` in light turbulence, one fitted and one held out, are simulated with an effect that the aircraft
file does not state, and thinned out to what a log would keep (``bench.estimation.log_rates``): no vanes, the airspeed
completed by the IMU. Every log is diagnosed, those that ``sysid gap`` refuses, too. Effects and sizes were chosen
before the first run. Finished cases are kept in ``--out``, so that the command goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.estimation.log_rates import LOGS, logged
from bench.pages import publish, table
from bench.speed.diagnosis import flown
from bench.spikes.judging import Judged, judge
from sysid_node.aircraft.load import load_aircraft
from sysid_node.gap.diagnose import diagnose
from sysid_node.gap.document import document
from sysid_node.gap.flightdata.gap_flight import flights_of_streams

#: Effect -> its size; in the last row there is none.
EFFECTS: Mapping[str, Mapping[str, float]] = {
    "actuator_lag": {"time_constant": 0.1},
    "command_delay": {"delay": 0.08},
    "airspeed_scale": {"error": 0.15},
    "imu_bias": {"q": 0.04},
    "imu_lever_arm": {"x": 0.3},
    "control_effectiveness_loss": {"aileron": 0.5, "onset": 20.0},
    "cg_shift": {"x": 0.03},
    "inertia_error": {"Iyy": 0.5},
    "": {},
}

#: How commands move -> the manoeuvres of each surface.
COMMANDS: Mapping[str, tuple[str, ...]] = {
    "steps": tuple(f"3211:{surface}:repeat=6" for surface in ("elevator", "aileron", "rudder")),
    "smooth": ("multisine",),
}

#: Logs of ``bench.estimation.log_rates``, by the beginnings of their names.
_LOGS = ("all at full rate", "commands 50 Hz", "commands 25 Hz")
_AIRCRAFT = "cdrw"
_FIRST = 31  # seed


def main() -> None:
    """Diagnoses what is not finished, and prints or publishes the table of each kind of commands."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    parser.add_argument("--out", type=Path, default=Path("out/gap_log_rates"))
    parser.add_argument("--commands", choices=[*COMMANDS], help="these alone")
    args = parser.parse_args()
    for commands in COMMANDS:
        if args.commands in (None, commands):
            rows = [row_of(args.out, commands, log) for log in LOGS if log.startswith(_LOGS)]
            heads = ("log", "named", "size right", "also blamed", "with nothing wrong", "not named, or wrong in size")
            publish(f"bench/gap/log_rates.py {commands}", table(heads, rows), args.page)


def row_of(out: Path, commands: str, log: str) -> tuple[str, ...]:
    """What is right of the diagnoses of one log's flights."""
    pairs = [(effect, _judged(_diagnosed(out, commands, log, effect), effect)) for effect in EFFECTS]
    spiked = [(effect, case) for effect, case in pairs if effect]
    plain = next(case for effect, case in pairs if not effect)
    named = [case for _, case in spiked if case.named]
    wrong = [effect for effect, case in spiked if not (case.named and case.sized is not False)]
    row = (
        log,
        f"{len(named)} of {len(spiked)}",
        f"{sum(case.sized is not False for case in named)} of {len(named)}",
        f"{sum(case.blamed for _, case in spiked)}",
        "a cause is blamed" if plain.blamed else "nothing is blamed",
        ", ".join(f"`{effect}`" for effect in wrong) or "-",
    )
    print(*row, sep="  ", flush=True)
    return row


def _judged(said: Mapping[str, Any], effect: str) -> Judged:
    return judge({**said, "effect": effect, "values": EFFECTS[effect]}, (), None)


def _diagnosed(out: Path, commands: str, log: str, effect: str) -> Mapping[str, Any]:
    """What gap.json says of one case's flights, diagnosed unless it is finished."""
    path = out / f"{commands}_{effect or 'none'}_{list(LOGS).index(log)}.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        aircraft = load_aircraft(_AIRCRAFT)
        fitted, held_out = (
            flights_of_streams(logged(bag, LOGS[log], vanes=False), aircraft, bag.name)
            for bag in _bags(out, commands, effect)
        )
        said = document(diagnose(aircraft, fitted, held_out))
        path.write_text(json.dumps(said, default=float), encoding="utf-8")
        print(commands, effect, log, said["verdict"], [(c["label"], c["probability"]) for c in said["causes"]])
    found: Mapping[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def _bags(out: Path, commands: str, effect: str) -> Sequence[Path]:
    """A flight to be fitted and one to be held out."""
    words = ["--turbulence", "light", "--rate", "100", "--duration", "60"]
    words += [word for manoeuvre in COMMANDS[commands] for word in ("--manoeuvre", manoeuvre)]
    if effect:
        sizes = (f"{name}={size}" for name, size in EFFECTS[effect].items())
        words += ["--effect", ":".join([effect, *sizes])]
    bags = [out / f"{commands}_{effect or 'none'}_flight_{seed}" for seed in (_FIRST, _FIRST + 1)]
    return [bag if bag.exists() else flown(bag, _FIRST + k, words, _AIRCRAFT) for k, bag in enumerate(bags)]


if __name__ == "__main__":
    main()
