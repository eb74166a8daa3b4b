"""The page of effects: equation, parameters, source, and a picture of the response to doublets with each.

python -m sysid_node.sim.pages.effects_page [--out docs/reference]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim.effects import EFFECTS, STATIONS, Effect, SimulationParameter
from sysid_node.sim.flying.trim import trim_flight
from sysid_node.sim.model.layout import OUTPUTS
from sysid_node.sim.model.state import STATES
from sysid_node.sim.pages.line_chart import LineChart, draw
from sysid_node.sim.signals.dryden import Dryden
from sysid_node.sim.simulator import Simulator

Array = NDArray[np.float64]

AIRCRAFT, RATE, SECONDS = "kestrel", 100.0, 9.0

#: Parameters of each effect in its picture.
EXAMPLES = {
    "command_delay": "delay=0.15",
    "actuator_lag": "time_constant=0.15",
    "actuator_backlash": "elevator=0.05:aileron=0.05:rudder=0.05",
    "actuator_rate_limit": "rate=0.4",
    "actuator_bias": "aileron=0.01",
    "stuck_surface": "rudder=1:rudder_position=0.05:onset=5",
    "control_effectiveness_loss": "elevator=0.5",
    "steady_wind": "north=-4:east=3",
    "turbulence": "intensity=0.7",
    "gust": "down=-3:start=2.5:length=20",
    "derivative_error": "Cm_alpha=0.4:Cn_beta=0.03",
    "nonlinear_pitching_moment": "quadratic=8",
    "stall_separation": "depth=1:alpha_star=0.08",
    "unsteady_aerodynamics": "CL_alphadot=5:Cm_alphadot=-40",
    "lateral_alpha_coupling": "Cl_beta_alpha=-6:Cn_beta_alpha=3",
    "control_nonlinearity": "elevator=30:rudder=20",
    "drag_rise": "parabola=0.3",
    "lateral_asymmetry": "Cl_0=0.001:Cn_0=0.001",
    "ground_effect": "lift=0.2:drag=0.05:height=0.5",
    "thrust_scale": "error=0.5",
    "thrust_line_offset": "arm=0.05",
    "thrust_yaw": "arm=0.02:torque_arm=0.01",
    "propwash": "gain=4",
    "motor_lag": "time_constant=0.8",
    "mass_error": "error=0.15",
    "inertia_error": "Iyy=2:Ixx=1",
    "cg_shift": "x=-0.005",
    "structural_mode": "gain=1:frequency=5:damping=0.02",
    "imu_bias": "ax=0.3:q=0.05",
    "imu_scale": "az=0.1:q=0.1",
    "imu_misalignment": "pitch=0.05",
    "imu_lever_arm": "x=0.3",
    "airspeed_scale": "error=0.08",
    "vane_bias": "alpha=0.02",
    "vane_scale": "alpha=0.2:beta=0.2",
    "vane_lever_arm": "x=1.5",
    "air_data_lag": "time_constant=0.2",
    "sensor_noise": "scale=1",
    "imu_delay": "delay=0.15",
    "air_data_delay": "delay=0.15",
    "actuator_stamp_delay": "delay=0.15",
}

_INTRODUCTION = """# The effects

Written by `python -m sysid_node.sim.pages.effects_page`; do not edit.

The simulator is a chain of stations: {chain}. An effect is one way in which an aircraft differs from its file, at one
station. All of them are always in the program, neutral by default: then they change nothing, and one Jacobian shows
what each would do to every reading. On the command line: `sysid simulate ... --effect NAME:KEY=VALUE`.

Corners and jumps are rounded so that an optimiser can use their derivatives. A clip is
`x / (1 + |x / limit|^16)^(1/16)` (rate limit), a dead zone the same with 64 (backlash: what leaks through adds up over
samples, so the corner is sharp), an onset a logistic step of 0.05 s; the root of the separated flow is rounded below
X = 1e-4. Lags are solved exactly for inputs linear between samples: at a time constant of 0 they do nothing, and their
derivative there is that of a delay. An effect whose limit is infinite is held by its inverse (`inverse_rate`);
`rate=0.4` may be said too. A rate limit that does not act has no slope: start an optimiser from its plausible size.

`actuator_lag`, `actuator_rate_limit` and `command_delay` have a value for each control, named after it:
`actuator_lag:elevator=0.12`. The first key of their tables means all controls at once; a control that is named beside
it keeps its own value: `actuator_lag:time_constant=0.03:elevator=0.12`.

An aircraft file may state effects, too ([The aircraft file](aircraft_file.md)). They are what the simulator flies by
default. A parameter that `--effect` states replaces the file's; all others stay as the file states them.

Pictures: doublets of {aircraft} on elevator (1 s), aileron (3.5 s) and rudder (5.5 s), more thrust from 7.5 s on; grey
without the effect, blue with it; of all readings the two that change most, by their own range.
"""


def main() -> None:
    """Writes ``effects.md`` and ``effects/NAME.svg`` into a folder."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/reference"))
    folder = parser.parse_args().out
    (folder / "effects").mkdir(parents=True, exist_ok=True)
    for name, text in pictures().items():
        (folder / "effects" / f"{name}.svg").write_text(text, encoding="utf-8")
    (folder / "effects.md").write_text(page(), encoding="utf-8")


def page() -> str:
    """The page, in Markdown."""
    simulator = Simulator(load_aircraft(AIRCRAFT), RATE)
    parts = [_INTRODUCTION.format(chain=" → ".join(STATIONS), aircraft=AIRCRAFT)]
    for station in STATIONS:
        parts.append(f"## Station `{station}`\n")
        parts += [_section(simulator, effect) for effect in EFFECTS.values() if effect.station == station]
    return "\n".join(parts)


def _section(simulator: Simulator, effect: Effect) -> str:
    parameters = effect.parameters(simulator.layout)
    if effect.name == "derivative_error":
        rows = ["| the derivative's name | per unit of its regressor | 0 | the file's tolerance | any | added to it |"]
    elif effect.shared:
        rows = _rows_of_controls(effect, parameters)
    else:
        rows = [_row(parameter) for parameter in parameters]
    return "\n".join(
        [
            f"### {effect.name}\n",
            f"{effect.summary}\n",
            *(f"    {line.strip()}" for line in effect.equation.split(";")),
            "\n| key | unit | neutral | plausible | range | meaning |\n|---|---|---|---|---|---|",
            *rows,
            f"\nSource: {effect.source}.\n",
            f"![{effect.name}](effects/{effect.name}.svg)\n`--effect {effect.name}:{EXAMPLES[effect.name]}`\n",
        ]
    )


def _rows_of_controls(effect: Effect, parameters: Sequence[SimulationParameter]) -> list[str]:
    """The rows of what all controls share, of each control, and of the rest."""
    shared, names = parameters[0], EFFECT_NAMES[effect.name]
    known, (per_control,) = {p.name for p in names.fixed}, names.each
    rows = [_row(replace(shared, meaning=f"{shared.meaning}, all controls"))]
    for parameter in parameters[1:]:
        if parameter.name in known:
            rows.append(_row(parameter))
            continue
        neutral, scale = (1.0 / x if shared.reciprocal and x else x for x in (shared.neutral, shared.scale))
        bounds = f"{per_control.lower:g} to {per_control.upper:g}"
        size = f"{'inf' if shared.reciprocal else f'{neutral:g}'} | {scale:g} | {bounds}"
        meaning = f"largest {shared.reciprocal}" if shared.reciprocal else shared.meaning
        rows.append(f"| {parameter.name} | {per_control.unit} | {size} | {meaning}, {parameter.name} alone |")
    return rows


def _row(p: SimulationParameter) -> str:
    key = f"{p.name} (or {p.reciprocal})" if p.reciprocal else p.name
    shape = "" if p.switch else " (shapes the effect)"
    return f"| {key} | {p.unit} | {p.neutral:g} | {p.scale:g} | {p.lower:g} to {p.upper:g} | {p.meaning}{shape} |"


def pictures() -> dict[str, str]:
    """SVG of every effect."""
    simulator = Simulator(load_aircraft(AIRCRAFT), RATE)
    trim = trim_flight(simulator)
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    random = np.random.default_rng(1)
    inputs = simulator.inputs(
        trim.command + _doublets(simulator, time),
        turbulence=Dryden.at(50.0, simulator.aircraft.geometry.b).realisation(time.size, RATE, 16.0, random),
        noise=random.standard_normal((time.size, len(OUTPUTS))),
    )

    def fly(theta: Array) -> Array:
        flight = simulator.rollout(theta, trim.initial, inputs)
        return np.hstack([np.asarray(flight.outputs), np.asarray(flight.states)[:, :3]])

    before, drawn = fly(simulator.neutral()), {}
    for name, example in EXAMPLES.items():
        after = fly(simulator.vector([f"{name}:{example}"]))
        drawn[name] = draw(_panels(simulator, time, before, after), f"doublet response with {name}")
    return drawn


def _doublets(simulator: Simulator, time: Array) -> Array:
    """Deflections (N, controls + 1)."""
    moves = np.zeros((time.size, len(simulator.commands)))
    for i, (start, size) in enumerate(((1.0, 0.05), (3.5, 0.05), (5.5, 0.1))):
        moves[:, i] = size * ((time >= start) & (time < start + 0.4))
        moves[:, i] -= size * ((time >= start + 0.4) & (time < start + 0.8))
    moves[:, -1] = 2.0 * (time >= 7.5)
    return moves


def _panels(simulator: Simulator, time: Array, before: Array, after: Array) -> list[LineChart]:
    """Charts of the one or two readings, or coordinates of the ground track, that change most for their range."""
    names = (*OUTPUTS, *STATES[:3])
    sigma = np.concatenate([np.asarray(simulator.model.noise), [1.0] * 3])
    change = np.abs(after - before).max(axis=0)
    seen = change / np.ptp(np.vstack([before, after]), axis=0).clip(10.0 * sigma)
    seen[len(OUTPUTS) :] *= (
        0.1 if change[: len(OUTPUTS)].any() else 1.0
    )  # the ground track is shown only where no reading changes
    best = [i for i in np.argsort(seen)[-1:-3:-1] if change[i] > sigma[i]]
    return [LineChart(f"{names[i]}, {_unit(names[i])}", time, before[:, i], after[:, i]) for i in best]


def _unit(name: str) -> str:
    units = {"ax": "m/s²", "ay": "m/s²", "az": "m/s²", "p": "rad/s", "q": "rad/s", "r": "rad/s", "V": "m/s"}
    return units.get(name, "m" if name in STATES[:3] else "rad")


if __name__ == "__main__":
    main()
