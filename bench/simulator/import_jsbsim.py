"""Whether an imported JSBSim model flies as JSBSim does.

    python -m bench.simulator.import_jsbsim [--page FILE] [NAME...]

Every aircraft that comes with JSBSim is imported. Both programs then fly ten seconds from the same level flight, with a
3-2-1-1 on elevator, aileron and rudder one after the other: JSBSim through the model's own flight control system where
that does not feed the motion back, else with the surfaces held directly. The error of a signal is its largest
difference over its range in JSBSim.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("JSBSIM_DEBUG", "0")

import numpy as np
from numpy.typing import NDArray

from bench.pages import publish, table
from sysid_node.errors import InputError
from sysid_node.sim import Simulator
from sysid_node.sim.importing.jsbsim.files import copy_model, jsbsim_root
from sysid_node.sim.importing.jsbsim.program import Program
from sysid_node.sim.importing.jsbsim.read import JsbsimModel, read_model
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS, properties_at

Array = NDArray[np.float64]

SECONDS, RATE, SUBSTEPS = 10.0, 200.0, 6
SIGNALS = ("p", "q", "r", "alpha", "beta")
ALLOWED = 0.02
_READ = (*(f"velocities/{axis}-rad_sec" for axis in "pqr"), "aero/alpha-rad", "aero/beta-rad")
_BEGINS = {"elevator": 0.5, "aileron": 3.5, "rudder": 6.5}  # s


@dataclass(frozen=True)
class Outcome:
    """One aircraft: share of range per signal, or why there is none."""

    name: str
    errors: Array | None
    ranges: Array | None
    seconds: float
    tables: int
    how: str
    why: str


def main() -> None:
    """Print the table, or put it in the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="aircraft (default: all that come with JSBSim)")
    parser.add_argument("--amplitude", type=float, default=0.04, help="of the 3-2-1-1, rad (default: 0.04)")
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    root = jsbsim_root() / "aircraft"
    names = args.names or sorted(p.name for p in root.iterdir() if (p / f"{p.name}.xml").is_file())
    outcomes = []
    for name in names:
        outcomes.append(examine(name, args.amplitude))
        print(_row(outcomes[-1]), flush=True)
    heads = ("aircraft", "import", "tables", "flown", *SIGNALS, "within 2 %", "why not")
    good = sum(o.errors is not None and bool((o.errors < ALLOWED).all()) for o in outcomes)
    text = table(heads, [_row(o) for o in outcomes])
    text += f"\n\n{good} of {len(outcomes)} are within 2 % in every signal."
    publish("bench/simulator/import_jsbsim.py", text, args.page)


def examine(name: str, amplitude: float) -> Outcome:
    """Import one aircraft and fly it in both programs."""
    start = time.process_time()
    try:
        model = read_model(name)
    except InputError as error:
        return Outcome(name, None, None, time.process_time() - start, 0, "", str(error))
    spent = time.process_time() - start
    deflections = _manoeuvre(model, amplitude)
    own = not any(surface.feedback for surface in model.surfaces)
    theirs = fly_there(model, deflections, own=own)
    ours = fly_here(model, deflections)
    ranges = np.ptp(theirs, axis=0)
    errors = np.abs(ours - theirs).max(axis=0) / ranges
    tables = len(model.imported.aircraft.tables)
    how = "own control system" if own else "surfaces held"
    return Outcome(name, errors, ranges, spent, tables, how, _why(model, theirs, ours, errors))


def _manoeuvre(model: JsbsimModel, amplitude: float) -> Array:
    """Deflections (N, surfaces), rad, of all samples of JSBSim's flight; edges take 40 ms."""
    frames = round(SECONDS * RATE * SUBSTEPS) + 1
    time_s = np.arange(frames) / (RATE * SUBSTEPS)
    columns = []
    for surface in model.surfaces:
        trim = model.steady.deflections[surface.name]
        room = min(surface.deflection[-1] - trim, trim - surface.deflection[0])
        size = min(amplitude, 0.5 * room)
        edges = _BEGINS[surface.name] + 0.3 * np.array([0.0, 3.0, 5.0, 6.0, 7.0])
        nodes = np.sort([*edges, *(edges + 0.04)])
        levels = np.repeat([0.0, 1.0, -1.0, 1.0, -1.0, 0.0], 2)[1:-1]
        columns.append(trim + size * np.interp(time_s, nodes, levels))
    return np.column_stack(columns)


def fly_there(model: JsbsimModel, deflections: Array, *, own: bool) -> Array:
    """Rates and flow angles (N, 5) in JSBSim."""
    with tempfile.TemporaryDirectory() as place:
        moved = () if own else {name for surface in model.surfaces for name in surface.properties}
        program = Program(copy_model(model.files, Path(place), moved), RATE * SUBSTEPS)

    def driven(row: Array) -> dict[str, float]:
        given = {surface.name: value for surface, value in zip(model.surfaces, row.tolist(), strict=True)}
        if not own:
            return properties_at(model.surfaces, given)
        return {COMMANDS[surface.name]: surface.command_for(given[surface.name]) for surface in model.surfaces}

    program.put(model.steady.state, driven(deflections[0]))
    program.step(round(3.0 * RATE * SUBSTEPS) if own else 2)  # servos come to rest on the trim
    rows = [program.read(_READ)]
    for i, row in enumerate(deflections[1:], 1):
        program.drive(driven(row))
        program.fdm.run()
        if i % SUBSTEPS == 0:
            rows.append(program.read(_READ))
    return np.array(rows)


def fly_here(model: JsbsimModel, deflections: Array) -> Array:
    """The same by this package's simulator, from the aircraft file alone."""
    aircraft, state = model.imported.aircraft, model.steady.state
    simulator = Simulator(aircraft, RATE)
    euler = (state.phi, state.theta, 0.0)
    initial = simulator.initial(state.airspeed, state.alpha, state.beta, euler)
    thrust = (aircraft.throttle.max_thrust or 1.0) * state.throttle if aircraft.throttle else 0.0
    commands = deflections[::SUBSTEPS]
    bias = aircraft.effects.get("actuator_bias", {})
    offsets = np.array([bias[s.name].value if s.name in bias else 0.0 for s in model.surfaces])
    inputs = simulator.inputs(np.column_stack([commands - offsets, np.full(len(commands), thrust)]))
    states = np.asarray(simulator.rollout(simulator.vector({}), initial, inputs).states)
    u, v, w = states[:, 3:6].T
    return np.column_stack([states[:, 10:13], np.arctan2(w, u), np.arctan2(v, np.hypot(u, w))])


def _why(model: JsbsimModel, theirs: Array, ours: Array, errors: Array) -> str:
    """What is seen where a flight is not within the limit."""
    if not np.isfinite(errors).all():
        return "the flight diverges"
    if (errors < ALLOWED).all():
        return ""
    largest = np.abs(theirs).max(axis=0)
    if largest[3] > 0.35 or largest[4] > 0.35:
        angles = np.rad2deg(largest[3:])
        return f"it leaves controlled flight (alpha {angles[0]:.0f}, beta {angles[1]:.0f} degrees)"
    first = np.argmax((np.abs(ours - theirs) > ALLOWED * np.ptp(theirs, axis=0)).any(axis=1)) / RATE
    return f"{SIGNALS[int(np.argmax(errors))]} from {first:.1f} s on"


def _row(outcome: Outcome) -> list[str]:
    why = outcome.why.partition("; give")[0]
    if outcome.errors is None:
        return [outcome.name, "-", "-", "-", *(["-"] * len(SIGNALS)), "-", why]
    shares = [f"{100.0 * error:.2f} %" for error in outcome.errors]
    verdict = "yes" if (outcome.errors < ALLOWED).all() else "no"
    return [outcome.name, f"{outcome.seconds:.1f} s", str(outcome.tables), outcome.how, *shares, verdict, why]


if __name__ == "__main__":
    main()
