"""Flights by the hundred: one compiled simulator over a batch of noise and turbulence, as aligned samples.

The aircraft is flown at 200 Hz. Air data are taken at 100 Hz and interpolated linearly in between, as the intake does;
surfaces and thrust are measured. The truth is the aircraft file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import air_density
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.online.types import SAMPLE_COLUMNS
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.flying.attitude_loops import AttitudeLoops, autopilot_with
from sysid_node.sim.flying.autopilot import Autopilot, fly_held
from sysid_node.sim.flying.rollout import RolloutInputs, SimulatedFlight
from sysid_node.sim.flying.trim import Trim
from sysid_node.sim.model.layout import OUTPUTS
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden

Array = NDArray[np.float64]
Effects = Mapping[str, Mapping[str, float]]

RATE = 200.0  # Hz, of the IMU and the integration
AIR_INTERVAL = 2 / RATE  # s between air data
HEIGHT = 100.0  # m above the ground, for the turbulence
ROTARY = slice(3, 6)  # of the gusts: the air's rotation
HELD = np.array([OUTPUTS.index(name) for name in ("p", "q", "r", "phi", "theta", "V")])  # by the autopilot
AIR = [OUTPUTS.index(name) for name in ("V", "alpha", "beta")]

PERIOD = 6.0  # s from one manoeuvre to the next on the same surface


def multistep(seconds: float) -> tuple[str, ...]:
    """3-2-1-1s on each surface in turn, all within the first five seconds, every other one turned round."""
    return tuple(
        f"3211:{surface}:amplitude={sign * size}:width={width}:{_times(start + late, 7 * width, 2 * PERIOD, seconds)}"
        for surface, size, width, start in (
            ("elevator", 0.06, 0.3, 0.7),
            ("aileron", 0.06, 0.25, 0.9),
            ("rudder", 0.12, 0.3, 2.7),
        )
        for sign, late in ((1, 0.0), (-1, PERIOD))
        if start + late + 7 * width <= seconds
    )


def doublets(seconds: float) -> tuple[str, ...]:
    """For flights without an autopilot: no net bank, pitch or yaw is left, so that the aircraft stays near trim."""
    return tuple(
        f"doublet:{surface}:amplitude={amplitude}:width=0.35:{_times(start, 0.7, PERIOD, seconds)}"
        for surface, amplitude, start in (("elevator", 0.05, 0.7), ("aileron", 0.05, 0.9), ("rudder", 0.1, 2.7))
    )


def _times(start: float, length: float, every: float, seconds: float) -> str:
    """As often as it fits into the flight."""
    return f"start={start:g}:every={every:g}:repeat={int((seconds - start - length) / every) + 1}"


@dataclass(frozen=True)
class Setting:
    """In what, and how, a batch is flown."""

    name: str
    turbulence: str = "none"
    autopilot: bool = True
    stiffness: float = 1.0  # times the gains of the autopilot
    loops: AttitudeLoops | None = None  # of the autopilot; none: the simulator's own
    seconds: float = 60.0
    manoeuvre: Sequence[str] = ()  # none: multistep, or without the autopilot doublets
    effects: Effects = field(default_factory=dict)
    later: Effects = field(default_factory=dict)  # from ``onset`` on, besides
    onset: float = math.inf  # s
    vane_noise: float = 1.0  # of the aircraft file's
    rotary: bool = True  # whether the turbulence turns the air, too


@dataclass(frozen=True)
class Batch:
    """Aligned samples of F flights: time (N,) s, samples (F, N, M) as ``online.run`` takes them."""

    time: Array
    samples: Array


def noisier(aircraft: Aircraft, vane_noise: float) -> Aircraft:
    """The aircraft with so many times the file's noise on alpha and beta."""
    noise = {n: v * vane_noise if n in ("alpha", "beta") else v for n, v in aircraft.noise.items()}
    return replace(aircraft, noise=noise)


def fly(aircraft: str, setting: Setting, seeds: Sequence[int]) -> Batch:
    """One flight for each seed. Raises InputError where one diverges."""
    simulator = _simulator(aircraft, setting.vane_noise)
    effects = {**setting.effects, "sensor_noise": {"scale": 1.0}}
    if setting.turbulence != "none":
        effects["turbulence"] = {"intensity": INTENSITIES[setting.turbulence]}
    theta, later = simulator.vector(effects), simulator.vector({**effects, **setting.later})
    trim = trim_flight(simulator, theta=theta)
    usual = multistep if setting.autopilot else doublets
    flown = setting.manoeuvre or usual(setting.seconds)
    plan = parse_manoeuvre(flown, simulator.aircraft, RATE, setting.seconds)
    commands = jnp.asarray(trim.command + np.column_stack([plan.surfaces(), np.zeros(plan.time.size)]))
    pilot = _pilot(simulator, trim, setting) if setting.autopilot else None

    def one(gusts: Any, noise: Any) -> Any:
        inputs = simulator.inputs(commands, turbulence=gusts, noise=noise)
        if setting.onset > setting.seconds:
            return _flown(simulator, theta, trim, inputs, pilot)
        return _flown_on(simulator, (theta, later), trim, inputs, pilot, round(setting.onset * RATE))

    flights = jax.vmap(one)(*_weather(simulator, setting, plan.time.size, seeds))
    for i in range(len(seeds)):
        simulator.check(jax.tree.map(lambda x, i=i: x[i], flights))
    return Batch(plan.time, _samples(np.asarray(flights.outputs), np.asarray(flights.surfaces), flights.states))


def _pilot(simulator: Simulator, trim: Trim, setting: Setting) -> Autopilot:
    """The autopilot with the setting's loops and so many times their gains; its authority stays."""
    pilot = autopilot_with(setting.loops, simulator, trim)
    return pilot._replace(gains=setting.stiffness * pilot.gains, integral=setting.stiffness * pilot.integral)


def _flown(
    simulator: Simulator, theta: Array, trim: Trim, inputs: RolloutInputs, pilot: Autopilot | None
) -> SimulatedFlight:
    """One flight from trim, in the autopilot's hands if there is one."""
    if pilot is None:
        return simulator.rollout(theta, trim.initial, inputs)
    return fly_held(simulator, theta, trim, inputs, pilot)


def _flown_on(
    simulator: Simulator,
    thetas: tuple[Array, Array],
    trim: Trim,
    inputs: RolloutInputs,
    pilot: Autopilot | None,
    onset: int,
) -> SimulatedFlight:
    """One flight that goes on from sample ``onset`` as another aircraft, at what the autopilot's integrals were."""
    before = _flown(simulator, thetas[0], trim, jax.tree.map(lambda x: x[: onset + 1], inputs), pilot)
    rest = jax.tree.map(lambda x: x[onset:], inputs)
    if pilot is not None:
        error = before.outputs[onset - 1, HELD] - pilot.hold
        integrals = before.commands[onset] - rest.commands[0] - pilot.gains @ error
        rest = rest._replace(commands=(rest.commands + integrals).at[0].set(before.commands[onset]))
    after = _flown(simulator, thetas[1], replace(trim, initial=before.states[onset]), rest, pilot)
    return SimulatedFlight(*(jnp.concatenate([a[:onset], b]) for a, b in zip(before, after, strict=True)))


@lru_cache
def _simulator(aircraft: str, vane_noise: float) -> Simulator:
    return Simulator(noisier(load_aircraft(aircraft), vane_noise), RATE)


def _weather(simulator: Simulator, setting: Setting, samples: int, seeds: Sequence[int]) -> tuple[Array, Array]:
    """Gusts (F, N, 6) and noise (F, N, 12), unscaled, from the seeds."""
    aircraft = simulator.aircraft
    dryden = Dryden.at(HEIGHT, aircraft.geometry.b)
    gusts, noise = np.zeros((len(seeds), samples, 6)), np.empty((len(seeds), samples, len(OUTPUTS)))
    for i, seed in enumerate(seeds):
        air, sensors = np.random.default_rng(seed).spawn(2)
        noise[i] = sensors.standard_normal(noise.shape[1:])
        if setting.turbulence != "none":
            gusts[i] = dryden.realisation(samples, RATE, aircraft.reference.airspeed, air)
    if not setting.rotary:
        gusts[..., ROTARY] = 0.0
    return gusts, noise


def _samples(outputs: Array, surfaces: Array, states: Any) -> Array:
    """(F, N, M) from readings (F, N, 12), surfaces and thrust (F, N, controls + 1) and true states (F, N, 13)."""
    air = outputs[..., AIR]
    air[:, 1:-1:2] = 0.5 * (air[:, :-2:2] + air[:, 2::2])
    columns = {name: outputs[..., OUTPUTS.index(name)] for name in SAMPLE_COLUMNS if name in OUTPUTS}
    columns |= dict(zip(("V", "alpha", "beta"), np.moveaxis(air, -1, 0), strict=True))
    columns["rho"] = np.asarray(air_density(-states[..., 2], np))
    columns["thrust"] = surfaces[..., -1]
    columns["air_interval"] = np.full(outputs.shape[:2], AIR_INTERVAL)
    return np.concatenate([np.stack([columns[name] for name in SAMPLE_COLUMNS], axis=-1), surfaces[..., :-1]], axis=-1)
