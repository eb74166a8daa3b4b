"""A flight one sample at a time, with the same chain as ``rollout``, for a pilot that is another program.

    flight = start(simulator, trim, LiveConditions(seed=1), simulator.neutral())
    reading = step(simulator, flight, command)     # the present reading; then the flight advances by one sample

Effects are an argument of every step, so that they can change in flight. The surfaces follow a command by the end of
the next sample. The station ``clock`` is left out: the sender of the messages sets their stamps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.dynamics.atmosphere import air_density
from sysid_node.errors import InputError
from sysid_node.sim.effects import EFFECTS
from sysid_node.sim.flying.rollout import Pilot, advance, begin
from sysid_node.sim.flying.trim import Trim
from sysid_node.sim.model import parameters
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import OUTPUTS, AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.model.state import STATES
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden
from sysid_node.sim.simulator import Simulator
from sysid_node.sim.stations import airflow, command

Array = NDArray[np.float64]

#: Longest command delay that a live flight can have, s.
_LONGEST_DELAY = 0.5

#: Turbulence repeats after the first time; its end is faded into its beginning over the second, s.
_PERIOD, _FADE = 300.0, 10.0

#: Speed (m/s) and angular rate (rad/s) beyond which a flight has diverged.
_MOST_SPEED, _MOST_RATE = 1.0e3, 1.0e2

#: Index at which outputs, state and surfaces begin in the row that a step returns.
_PARTS = (1, 1 + len(OUTPUTS), 1 + len(OUTPUTS) + len(STATES))


@dataclass(frozen=True)
class LiveConditions:
    """Turbulence at a height above the ground (m), and noise as a multiple of the aircraft file's sigmas."""

    turbulence: str = "none"  # none, light, moderate, severe
    height: float = 100.0
    noise: float = 1.0
    seed: int = 0


class LiveReading(NamedTuple):
    """Readings of the instruments and the true motion at the beginning of a step."""

    time: float  # s
    outputs: Array  # (12,) layout.OUTPUTS
    state: Array  # (13,) state.STATES
    surfaces: Array  # (controls + 1,) true positions rad, thrust N
    density: float  # kg/m^3


class _LiveState(NamedTuple):
    """What one step passes to the next."""

    carry: Any
    history: Scalar  # (K, controls + 1) commands, the newest last
    surfaces: Scalar  # (controls + 1,) now


@dataclass
class LiveFlight:
    """A flight under way; ``step`` changes it."""

    theta: Array  # (P,) without turbulence and noise; may be replaced between steps
    samples: int
    altitude: float
    turbulence: Array  # (N, 6) of intensity 1 m/s; it is repeated
    intensity: float  # m/s
    noise: float
    random: np.random.Generator
    carried: _LiveState


def start(simulator: Simulator, trim: Trim, air: LiveConditions, theta: Array) -> LiveFlight:
    """A flight that begins in trim with effects (P,). Raises InputError on an unknown name of turbulence."""
    if air.turbulence not in INTENSITIES:
        raise InputError(f"turbulence {air.turbulence!r}: expected one of {', '.join(INTENSITIES)}")
    gusts, noise = np.random.default_rng(air.seed).spawn(2)
    speed = float(np.linalg.norm(trim.initial[3:6]))
    intensity = INTENSITIES[air.turbulence]
    turbulence = np.zeros((1, 6))
    if intensity:
        turbulence = _endless(Dryden.at(air.height, simulator.aircraft.geometry.b), simulator.rate, speed, gusts)
    altitude = -float(trim.initial[2])
    first = jnp.concatenate([jnp.asarray(trim.command), intensity * jnp.asarray(turbulence[0])])
    history = round(_LONGEST_DELAY * simulator.rate) + 2
    carried = _begin(simulator.layout, history, simulator.model, theta, simulator.step, trim.initial, first)
    return LiveFlight(theta, 0, altitude, turbulence, intensity, air.noise, noise, carried)


def step(simulator: Simulator, live: LiveFlight, commands: Sequence[float]) -> LiveReading:
    """The present reading, after which the flight advances by one sample with commands (controls + 1,), rad and N."""
    time = live.samples * simulator.step
    gust = live.intensity * live.turbulence[(live.samples + 1) % len(live.turbulence)]
    noise = live.noise * live.random.standard_normal(len(OUTPUTS))
    row = np.concatenate([commands, gust, noise, (time + simulator.step, live.altitude)])
    live.carried, reading = _advance(simulator.layout, simulator.model, live.theta, simulator.step, live.carried, row)
    live.samples += 1
    density, outputs, state, surfaces = np.split(np.asarray(reading), _PARTS)
    return LiveReading(time, outputs, state, surfaces, float(density[0]))


def divergence(now: LiveReading) -> str:
    """Why a reading is no flight's any more; empty where it is one.

    A reading that is not finite, or far beyond what the model's equations stand for, comes of a flight that was lost
    before. Nothing after it means anything.
    """
    values = {"outputs": now.outputs, "state": now.state, "surfaces": now.surfaces}
    for name, row in values.items():
        if not np.isfinite(row).all():
            return f"{name} are not finite"
    speed, rate = float(np.linalg.norm(now.state[3:6])), float(np.abs(now.outputs[3:6]).max())
    if speed > _MOST_SPEED or rate > _MOST_RATE:
        return f"speed {speed:.3g} m/s, angular rate {rate:.3g} rad/s"
    return ""


def vector(simulator: Simulator, effects: Sequence[str]) -> Array:
    """The vector (P,) of effects ``name:key=value``. Raises InputError, also on effects that a live flight
    cannot have."""
    for name in parameters.parse(effects):
        if EFFECTS[name].station == "clock" or name in ("turbulence", "sensor_noise", "actuator_stamp_delay"):
            raise InputError(f"effect {name} cannot be switched on in a live flight; choose another")
    return simulator.vector(effects)


@partial(jax.jit, static_argnums=(0, 1))
def _begin(
    layout: ParameterLayout,
    history: int,
    model: AircraftNumbers,
    theta: Scalar,
    step: Scalar,
    initial: Scalar,
    first: Scalar,
) -> _LiveState:
    chain = Chain.of(layout, model, theta, step, -initial[2])
    commands, gusts = first[:-6], first[-6:]
    carry, surfaces = begin(chain, initial, commands, gusts, (), jnp.zeros_like(chain.step))
    return _LiveState(carry, jnp.tile(commands, (history, 1)), surfaces)


@partial(jax.jit, static_argnums=0)
def _advance(
    layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, step: Scalar, carried: _LiveState, row: Scalar
) -> tuple[_LiveState, Scalar]:
    m = len(layout.commands)
    commands, gust, noise, time, altitude = row[:m], row[m : m + 6], row[m + 6 : -2], row[-2], row[-1]
    chain = Chain.of(layout, model, theta, step, altitude)
    chain.effects["sensor_noise"] = {"scale": jnp.ones(())}  # the noise is already scaled
    gusts = airflow.gusts(model, chain.effects, gust, jnp.zeros(6), time)
    past = jnp.concatenate([carried.history[1:], commands[None]])
    arriving = command.arrive_from_history(layout, chain.effects, past, step)
    follow: Pilot = lambda state, outputs, planned: (planned, planned, outputs)  # noqa: E731
    # the readings are returned through the pilot's state
    carry, (_, state, _, moved) = advance(chain, follow, carried.carry._replace(pilot=()), arriving, gusts, time, noise)
    density = air_density(-state[2], jnp)
    reading = jnp.concatenate([density[None], carry.pilot, state, carried.surfaces])
    return _LiveState(carry._replace(pilot=()), past, moved[:m]), reading


def _endless(dryden: Dryden, rate: float, speed: float, random: np.random.Generator) -> Array:
    """Gusts (N, 6) that can be repeated: what follows their end is faded into their beginning at constant variance."""
    count, fade = round(_PERIOD * rate), round(_FADE * rate)
    whole = dryden.realisation(count + fade, rate, speed, random)
    angle = 0.5 * np.pi * np.arange(fade)[:, None] / fade
    whole[:fade] = np.sin(angle) * whole[:fade] + np.cos(angle) * whole[count:]
    return whole[:count]
