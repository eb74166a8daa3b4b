"""A whole simulated flight from planned deflections: trim, turbulence, autopilot and noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError
from sysid_node.sim.flying.attitude_loops import AttitudeLoops, autopilot_with
from sysid_node.sim.flying.autopilot import fly_held
from sysid_node.sim.flying.rollout import RolloutInputs, SimulatedFlight
from sysid_node.sim.flying.trim import Trim, trim_flight
from sysid_node.sim.model.layout import OUTPUTS
from sysid_node.sim.model.parameters import parse, stated
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden
from sysid_node.sim.simulator import Simulator

Array = NDArray[np.float64]

Effects = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class SortieConditions:
    """The conditions of a simulated flight."""

    effects: Effects | Sequence[str] = field(default_factory=dict)  # differences between the aircraft and its file
    airspeed: float | None = None  # m/s, of the trim; None: that of the reference condition
    turbulence: str = "none"  # none, light, moderate, severe
    height: float = 100.0  # m above the ground, for the turbulence's scale lengths
    autopilot: bool = True
    noise: float = 1.0  # multiple of the aircraft file's sigmas
    seed: int = 0
    rotary_gusts: bool = True  # whether the turbulence has angular velocities, too
    command_rate: float | None = None  # Hz, of commands that are held; None: the simulator's, linear between samples
    loops: AttitudeLoops | None = None  # of the autopilot; None: the simulator's own


@dataclass(frozen=True)
class Sortie:
    """A simulated flight with its inputs and conditions."""

    simulator: Simulator
    conditions: SortieConditions
    effects: dict[str, dict[str, float]]  # those asked for, turbulence and noise
    theta: Array  # (P,)
    trim: Trim
    inputs: RolloutInputs
    flight: SimulatedFlight

    @property
    def derivatives(self) -> dict[str, float]:
        """The true derivatives: the file's plus ``derivative_error``."""
        error = stated(self.simulator.layout, self.theta, "derivative_error")
        return {name: d.value + error[name] for name, d in self.simulator.aircraft.derivatives.items()}

    @property
    def all_effects(self) -> dict[str, dict[str, float]]:
        """The effects flown: those asked for as they were stated, and the aircraft file's as they were flown."""
        filed = (name for name in self.simulator.aircraft.effect_values())
        return {**{name: stated(self.simulator.layout, self.theta, name) for name in filed}, **self.effects}

    @property
    def command_places(self) -> NDArray[np.intp]:
        """(K,) the samples at which a command is given; it is held until the next."""
        return np.flatnonzero(_given(self.simulator, self.conditions, len(self.flight.outputs)))


def fly_sortie(simulator: Simulator, deflections: Array, conditions: SortieConditions | None = None) -> Sortie:
    """The flight with deflections (N, controls + 1) from trim (rad, N), sampled at the simulator's rate.

    It begins in the trim with its effects. Raises InputError where there is no trim, a surface would pass its limit, or
    the flight diverges.
    """
    conditions = conditions or SortieConditions()
    effects = _all_effects(conditions)
    theta = simulator.vector(effects)
    trim = trim_flight(simulator, conditions.airspeed, theta)
    given = _given(simulator, conditions, len(deflections))
    commands = trim.command + deflections[np.flatnonzero(given)[np.cumsum(given) - 1]]
    _check_travel(simulator, commands)
    inputs = _inputs(simulator, trim, commands, conditions)
    if conditions.autopilot:
        pilot = autopilot_with(conditions.loops, simulator, trim)
        flight = fly_held(simulator, theta, trim, inputs, pilot, given)
    else:
        flight = simulator.rollout(theta, trim.initial, inputs)
    return Sortie(simulator, conditions, effects, theta, trim, inputs, simulator.check(flight))


def _all_effects(conditions: SortieConditions) -> dict[str, dict[str, float]]:
    """The effects asked for, and turbulence and noise of the conditions where these parameters are not given."""
    requested = conditions.effects if isinstance(conditions.effects, Mapping) else parse(conditions.effects)
    effects = {name: dict(values) for name, values in requested.items()}
    if conditions.turbulence not in INTENSITIES:
        raise InputError(f"turbulence {conditions.turbulence!r}: expected one of {', '.join(INTENSITIES)}")
    intensity = INTENSITIES[conditions.turbulence]
    for name, key, value in (("turbulence", "intensity", intensity), ("sensor_noise", "scale", conditions.noise)):
        if value:
            effects.setdefault(name, {}).setdefault(key, value)
    return effects


def _given(simulator: Simulator, conditions: SortieConditions, samples: int) -> NDArray[np.bool_]:
    """(N,) whether a new command is given at each sample; always at the first. Raises InputError for a wrong rate."""
    rate = simulator.rate if conditions.command_rate is None else conditions.command_rate
    if not 0.0 < rate <= simulator.rate:
        raise InputError(
            f"commands at {rate:g} Hz: expected more than 0 and at most the simulator's {simulator.rate:g}"
        )
    count = np.floor(np.arange(samples) * (rate / simulator.rate) + 1e-6)
    return np.asarray(np.diff(count, prepend=-1.0) > 0.0)


def _check_travel(simulator: Simulator, commands: Array) -> None:
    """Raise InputError where trim and manoeuvre together pass a control's limit."""
    limits = np.asarray(simulator.model.limits)
    beyond = np.abs(commands[:, :-1]) > limits * (1.0 + 1e-9)
    if beyond.any():
        k, i = np.unravel_index(int(beyond.argmax()), beyond.shape)
        raise InputError(
            f"manoeuvre: trim included, {simulator.commands[i]} reaches {commands[k, i]:.4g} rad at "
            f"{k * simulator.step:.2f} s, but its limit is {limits[i]:g}; lower the amplitude"
        )


def _inputs(simulator: Simulator, trim: Trim, commands: Array, conditions: SortieConditions) -> RolloutInputs:
    """Inputs with the commands and with realisations of turbulence and noise from the seed."""
    turbulence, noise = np.random.default_rng(conditions.seed).spawn(2)
    samples = len(commands)
    speed = float(np.linalg.norm(trim.initial[3:6]))
    dryden = Dryden.at(conditions.height, simulator.aircraft.geometry.b)
    gusts = dryden.realisation(samples, simulator.rate, speed, turbulence)
    gusts[:, 3:] *= conditions.rotary_gusts
    return simulator.inputs(commands, turbulence=gusts, noise=noise.standard_normal((samples, len(OUTPUTS))))
