"""The simulator of one aircraft: a thin shell that holds what the pure functions need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.atmosphere import altitude_of
from sysid_node.dynamics.attitude import quaternion
from sysid_node.errors import InputError
from sysid_node.sim.effects import Parameter
from sysid_node.sim.flying.rollout import Inputs, SimulatedFlight, rollout
from sysid_node.sim.model import parameters
from sysid_node.sim.model.layout import OUTPUTS, Layout, Model, Scalar, layout_of, model_of
from sysid_node.sim.model.state import STATES

Array = NDArray[np.float64]

#: No reading of a flight that means anything is larger, in SI units.
_SOUND = 1e4

_rollout = jax.jit(rollout, static_argnums=0)


@partial(jax.jit, static_argnums=0)
def _jacobian(layout: Layout, model: Model, theta: Scalar, initial: Scalar, inputs: Inputs, step: Scalar) -> Scalar:
    slopes: Scalar = jax.jacfwd(lambda t: _rollout(layout, model, t, initial, inputs, step).outputs)(theta)
    return slopes


@dataclass(frozen=True)
class Simulator:
    """One aircraft at one sampling rate (Hz), which is also the integration's. Raises InputError on either."""

    aircraft: Aircraft
    rate: float = 100.0

    def __post_init__(self) -> None:
        if not 10.0 <= self.rate <= 10000.0:
            raise InputError(f"rate {self.rate:g} Hz: expected 10 to 10000 Hz")

    @cached_property
    def layout(self) -> Layout:
        """What shapes the compiled program."""
        return layout_of(self.aircraft)

    @cached_property
    def model(self) -> Model:
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
        """Columns of ``Inputs.commands``: the aerodynamic controls (rad), then thrust (N)."""
        return self.layout.commands

    @property
    def parameters(self) -> tuple[tuple[str, Parameter], ...]:
        """(effect, parameter) of each entry of the vector."""
        return parameters.table(self.layout)

    @property
    def names(self) -> tuple[str, ...]:
        """``effect.parameter`` of each entry of the vector."""
        return parameters.names(self.layout)

    @cached_property
    def scales(self) -> Array:
        """A plausible size of each entry; of ``derivative_error`` the aircraft file's tolerances."""
        table = {f"derivative_error.{n}": d.tolerance for n, d in self.aircraft.derivatives.items()}
        pairs = zip(self.names, self.parameters, strict=True)
        return np.array([table.get(name) or parameter.scale for name, (_, parameter) in pairs])

    def neutral(self) -> Array:
        """The vector (P,) at which no effect does anything."""
        return parameters.neutral(self.layout)

    def vector(self, effects: Mapping[str, Mapping[str, float]] | Sequence[str]) -> Array:
        """The vector (P,) of effects, given as ``{effect: {parameter: value}}`` or ``["effect:parameter=value"]``.

        Raises InputError (unknown names, impossible values).
        """
        known = effects if isinstance(effects, Mapping) else parameters.parse(effects)
        return parameters.vector(self.layout, known)

    def effects(self, effects: Mapping[str, Mapping[str, float]] | Sequence[str]) -> dict[str, dict[str, float]]:
        """The same effects by every parameter of theirs, as the vector holds them. Raises InputError."""
        known = effects if isinstance(effects, Mapping) else parameters.parse(effects)
        values = parameters.unpack(self.layout, jnp.asarray(parameters.vector(self.layout, known)))
        return {name: {key: float(value) for key, value in values[name].items()} for name in known}

    def initial(
        self,
        airspeed: Scalar | float,
        alpha: Scalar | float = 0.0,
        beta: Scalar | float = 0.0,
        euler: Sequence[Scalar | float] = (0.0, 0.0, 0.0),
        rates: Sequence[Scalar | float] = (0.0, 0.0, 0.0),
        altitude: Scalar | float | None = None,
    ) -> Scalar:
        """The body's state (13,) of airspeed m/s, flow angles, Euler angles and rates (rad, rad/s), altitude m.

        The default altitude has the reference condition's air density. Traceable by JAX.
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
    ) -> Inputs:
        """Inputs of N samples from commands (N, controls + 1); what is not given is zero."""

        def filled(given: Scalar | Array | None, columns: int) -> Scalar:
            return jnp.zeros((commands.shape[0], columns)) if given is None else jnp.asarray(given)

        return Inputs(jnp.asarray(commands), filled(gusts, 6), filled(turbulence, 6), filled(noise, len(OUTPUTS)))

    def rollout(self, theta: Scalar | Array, initial: Scalar | Array, inputs: Inputs) -> SimulatedFlight:
        """An open-loop flight: pure, compiled, may be transformed by ``jax.vmap`` and ``jax.jacfwd``.

        theta (P,), initial (13,). A flight that diverges is not finite: ``check`` says so.
        """
        flight: SimulatedFlight = _rollout(self.layout, self.model, theta, initial, inputs, self.step)
        return flight

    def jacobian(self, theta: Scalar | Array, initial: Scalar | Array, inputs: Inputs) -> Scalar:
        """d outputs / d theta, (N, 12, P), exact (forward mode)."""
        slopes: Scalar = _jacobian(self.layout, self.model, theta, initial, inputs, self.step)
        return slopes

    def check(self, flight: SimulatedFlight) -> SimulatedFlight:
        """The flight, if it stays within what flies. Raises InputError naming the time at which it diverged."""
        sound = (np.abs(np.asarray(flight.outputs)) < _SOUND).all(axis=1)  # false for NaN
        if not sound.all():
            when = int(np.argmin(sound)) * self.step
            raise InputError(
                f"aircraft {self.aircraft.name!r}: the flight diverged at {when:.2f} s; "
                "use smaller deflections or effects, the autopilot, or a stable aircraft"
            )
        return flight
