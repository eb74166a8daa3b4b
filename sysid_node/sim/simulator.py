"""The simulator of one aircraft: its layout, numbers and rate, with the pure functions as methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.atmosphere import altitude_of
from sysid_node.dynamics.attitude import quaternion
from sysid_node.errors import InputError
from sysid_node.sim.compiled.programs import kept
from sysid_node.sim.effects import SimulationParameter
from sysid_node.sim.flying.lengths import cut, on_device, padded
from sysid_node.sim.flying.rollout import RolloutInputs, SimulatedFlight, rollout
from sysid_node.sim.model import parameters
from sysid_node.sim.model.layout import OUTPUTS, AircraftNumbers, ParameterLayout, Scalar, layout_of, model_of
from sysid_node.sim.model.state import STATES

Array = NDArray[np.float64]

#: Largest reading that a flight can reach without having diverged, SI units.
_LARGEST_READING = 1e4

#: Least and greatest sampling rate, Hz.
LOWEST_RATE, _HIGHEST_RATE = 10.0, 10000.0

#: Span of the aircraft for which the effects state how far a place may be off, m: a small UAV's.
_SPAN = 1.5

#: Effects by which something sits elsewhere than in the file.
_PLACES = frozenset({"cg_shift", "imu_lever_arm", "vane_lever_arm", "thrust_line_offset", "thrust_yaw"})

_rollout = jax.jit(rollout, static_argnums=0)  # that JAX may transform
_kept_rollout = kept(1)(rollout)


@kept(1)
def _jacobian(
    layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, initial: Scalar, inputs: RolloutInputs, step: Scalar
) -> Scalar:
    slopes: Scalar = jax.jacfwd(lambda t: _rollout(layout, model, t, initial, inputs, step).outputs)(theta)
    return slopes


@dataclass(frozen=True)
class Simulator:
    """One aircraft at one sampling rate (Hz), which is also the rate of integration.

    Raises InputError for a rate outside 10 to 10000 Hz.
    """

    aircraft: Aircraft
    rate: float = 100.0

    def __post_init__(self) -> None:
        if not LOWEST_RATE <= self.rate <= _HIGHEST_RATE:
            raise InputError(f"rate {self.rate:g} Hz: expected {LOWEST_RATE:g} to {_HIGHEST_RATE:g} Hz")

    @cached_property
    def layout(self) -> ParameterLayout:
        """The names of controls and derivatives, which shape the compiled program."""
        return layout_of(self.aircraft)

    @cached_property
    def model(self) -> AircraftNumbers:
        """The aircraft's numbers."""
        return model_of(self.aircraft)

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return 1.0 / self.rate

    @property
    def outputs(self) -> tuple[str, ...]:
        """Columns of ``SimulatedFlight.outputs``."""
        return OUTPUTS

    @property
    def states(self) -> tuple[str, ...]:
        """Columns of ``SimulatedFlight.states``."""
        return STATES

    @property
    def commands(self) -> tuple[str, ...]:
        """Columns of ``RolloutInputs.commands``: the aerodynamic controls (rad), then thrust (N)."""
        return self.layout.commands

    @property
    def parameters(self) -> tuple[tuple[str, SimulationParameter], ...]:
        """(effect, parameter) of each entry of the vector."""
        return parameters.table(self.layout)

    @property
    def names(self) -> tuple[str, ...]:
        """``effect.parameter`` of each entry of the vector."""
        return parameters.names(self.layout)

    @cached_property
    def scales(self) -> Array:
        """A plausible size (P,) of each entry, 1 sigma; for ``derivative_error`` the aircraft file's tolerances.

        Places of the CG, of sensors and of the thrust line are off in proportion to the aircraft's size: the effects
        state what is plausible at a span of ``_SPAN``.
        """
        table = {f"derivative_error.{n}": d.tolerance for n, d in self.aircraft.derivatives.items()}
        larger = self.aircraft.geometry.b / _SPAN
        table |= {
            name: larger * parameter.scale
            for name, (effect, parameter) in zip(self.names, self.parameters, strict=True)
            if effect in _PLACES and parameter.unit == "m"
        }
        pairs = zip(self.names, self.parameters, strict=True)
        return np.array([table.get(name) or parameter.scale for name, (_, parameter) in pairs])

    def neutral(self) -> Array:
        """The vector (P,) of the aircraft as its file describes it: the file's effects, and no others."""
        return self._file_vector.copy()

    @cached_property
    def _file_vector(self) -> Array:
        values = {name: stated for name, stated in self.aircraft.effect_values().items() if any(stated.values())}
        return parameters.vector(self.layout, values)

    def vector(self, effects: Mapping[str, Mapping[str, float]] | Sequence[str]) -> Array:
        """The vector (P,) of effects, given as ``{effect: {parameter: value}}`` or ``["effect:parameter=value"]``.

        A parameter that is given replaces the file's; all others stay as the file states them. Raises InputError
        (unknown names, impossible values).
        """
        known = effects if isinstance(effects, Mapping) else parameters.parse(effects)
        return parameters.vector(self.layout, known, self._file_vector)

    def effects(self, effects: Mapping[str, Mapping[str, float]] | Sequence[str]) -> dict[str, dict[str, float]]:
        """These effects and the file's with all of their parameters, as users state them. Raises InputError."""
        known = effects if isinstance(effects, Mapping) else parameters.parse(effects)
        theta = self.vector(known)
        return {
            name: parameters.stated(self.layout, theta, name)
            for name in dict.fromkeys((*self.aircraft.effect_values(), *known))
        }

    def initial(
        self,
        airspeed: Scalar | float,
        alpha: Scalar | float = 0.0,
        beta: Scalar | float = 0.0,
        euler: Sequence[Scalar | float] = (0.0, 0.0, 0.0),
        rates: Sequence[Scalar | float] = (0.0, 0.0, 0.0),
        altitude: Scalar | float | None = None,
    ) -> Scalar:
        """The body's state (13,) from airspeed m/s, flow angles, Euler angles and rates (rad, rad/s), altitude m.

        The default altitude has the reference condition's air density. JAX can trace this function.
        """
        height = altitude_of(self.aircraft.reference.air_density) if altitude is None else altitude
        velocity = velocity_of((jnp.asarray(x, float) for x in (airspeed, alpha, beta)), jnp)
        attitude = quaternion((jnp.asarray(x, float) for x in euler), jnp)
        return jnp.stack(
            [
                *(jnp.asarray(x, float) for x in (0.0, 0.0, -height)),
                *velocity,
                *attitude,
                *(jnp.asarray(x, float) for x in rates),
            ]
        )

    def inputs(
        self,
        commands: Scalar | Array,
        gusts: Scalar | Array | None = None,
        turbulence: Scalar | Array | None = None,
        noise: Scalar | Array | None = None,
    ) -> RolloutInputs:
        """Inputs of N samples from commands (N, controls + 1), rad and N; the other series default to zero."""

        def arrays(values: Scalar | Array) -> Scalar:
            return on_device(values) if isinstance(values, np.ndarray) else jnp.asarray(values)

        def filled(given: Scalar | Array | None, columns: int) -> Scalar:
            return arrays(np.zeros((commands.shape[0], columns)) if given is None else given)

        return RolloutInputs(arrays(commands), filled(gusts, 6), filled(turbulence, 6), filled(noise, len(OUTPUTS)))

    def rollout(self, theta: Scalar | Array, initial: Scalar | Array, inputs: RolloutInputs) -> SimulatedFlight:
        """The open-loop flight of parameters (P,) from a state (13,): pure and compiled.

        ``jax.vmap`` and ``jax.jacfwd`` may transform it. A flight that diverges is not finite; ``check`` raises then.
        """
        fixed, samples = (self.layout, self.model, theta, initial), len(inputs.commands)
        flight: SimulatedFlight
        if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves((theta, initial, inputs))):
            flight = _rollout(*fixed, inputs, self.step)
            return flight
        flight = _kept_rollout(*fixed, padded(inputs), self.step, samples)
        return cut(flight, samples)

    def jacobian(self, theta: Scalar | Array, initial: Scalar | Array, inputs: RolloutInputs) -> Scalar:
        """d outputs / d theta, (N, 12, P), exact (forward mode)."""
        slopes: Scalar = _jacobian(self.layout, self.model, theta, initial, inputs, self.step)
        return slopes

    def check(self, flight: SimulatedFlight) -> SimulatedFlight:
        """The flight itself where its readings stay bounded. Raises InputError naming the time of divergence."""
        within = (np.abs(np.asarray(flight.outputs)) < _LARGEST_READING).all(axis=1)  # false for NaN
        if not within.all():
            when = int(np.argmin(within)) * self.step
            raise InputError(
                f"aircraft {self.aircraft.name!r}: the flight diverged at {when:.2f} s; "
                "use smaller deflections or effects, the autopilot, or a stable aircraft"
            )
        return flight
