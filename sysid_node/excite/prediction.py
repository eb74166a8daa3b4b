"""What a manoeuvre would tell about an aircraft before anyone flies it, from the simulator's own Jacobian."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.excite.information import Information, eliminate, fisher
from sysid_node.excite.manoeuvre import THROTTLE, Manoeuvre
from sysid_node.sim import Flight, Inputs, Simulator, parameters
from sysid_node.sim.autopilot import autopilot_for, fly_held
from sysid_node.sim.layout import OUTPUTS, Layout, Model
from sysid_node.sim.rollout import rollout
from sysid_node.sim.trim import Trim, trim_flight

Array = NDArray[np.float64]

#: Outputs that a prediction counts on: all but the heading, which the derivatives hardly move.
MEASURED = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "V", "alpha", "beta")

#: States of the simulator whose initial values count as unknown: all but position and one part of the attitude, which
#: a heading that is not measured leaves open.
_INITIAL = (3, 4, 5, 7, 8, 10, 11, 12)


@dataclass(frozen=True)
class Prediction:
    """A manoeuvre, the flight that it gives, and the information in it.

    ``outputs`` (N, 12), columns ``Simulator.outputs``; ``commands`` (N, controls + 1) as flown, rad and N,
    trim and autopilot included.
    """

    manoeuvre: Manoeuvre
    outputs: Array
    commands: Array
    information: Information


class Predictor:
    """Predictions for one aircraft from one trim; programs are compiled once for each length of flight.

    With ``autopilot`` the simulator's attitude hold flies along. What it does to the controls is part of the input
    then: the estimator is taken to know the controls that were flown, not the plan.
    """

    def __init__(
        self, aircraft: Aircraft, rate: float = 100.0, airspeed: float | None = None, autopilot: bool = True
    ) -> None:
        """Raises InputError where the aircraft cannot be simulated, or not trimmed at ``airspeed`` (m/s)."""
        self.aircraft = aircraft
        self.simulator = Simulator(aircraft, rate)
        self.trim: Trim = trim_flight(self.simulator, airspeed)
        self.autopilot = autopilot_for(self.simulator, self.trim) if autopilot else None
        self.names = tuple(aircraft.derivatives)
        self.values = np.array([derivative.value for derivative in aircraft.derivatives.values()])
        self._columns = np.array([self.simulator.outputs.index(name) for name in MEASURED])
        self._sigma = np.asarray(self.simulator.model.noise)[self._columns]
        if not np.all(self._sigma > 0):
            zero = MEASURED[int(np.argmin(self._sigma))]
            raise InputError(
                f"aircraft {aircraft.name!r}: noise of {zero} is zero; a prediction needs noise on every sensor"
            )

    def predict(self, manoeuvre: Manoeuvre) -> Prediction:
        """Fly it from trim. Raises InputError where a control saturates or the flight diverges."""
        flight = self._fly(self.commands(manoeuvre))
        outputs, commands = np.asarray(flight.outputs), np.asarray(flight.commands)
        simulator, unknowns = self.simulator, np.zeros(len(self.names) + len(_INITIAL))
        slopes = _slopes(simulator.layout, simulator.model, unknowns, self.trim.initial, commands, simulator.step)
        matrix = fisher(np.asarray(slopes)[:, self._columns], self._sigma)
        information = Information(self.names, self.values, eliminate(matrix, len(self.names)))
        return Prediction(manoeuvre, outputs, commands, information)

    def commands(self, manoeuvre: Manoeuvre) -> Array:
        """The manoeuvre upon trim, (N, controls + 1): rad, and thrust in N."""
        throttle = self.aircraft.throttle
        thrust = np.zeros(manoeuvre.time.size)
        if throttle is not None:
            thrust = manoeuvre.deflections[THROTTLE] * (1.0 if throttle.max_thrust is None else throttle.max_thrust)
        commands = np.asarray(self.trim.command + np.column_stack([manoeuvre.surfaces(), thrust]))
        _check_travel(self.aircraft, manoeuvre, commands)
        return commands

    def _fly(self, commands: Array) -> Flight:
        simulator, inputs, theta = self.simulator, self.simulator.inputs(commands), self.simulator.neutral()
        if self.autopilot is None:
            return simulator.check(simulator.rollout(theta, self.trim.initial, inputs))
        return simulator.check(fly_held(simulator, theta, self.trim, inputs, self.autopilot))


def outputs_of(
    layout: Layout, model: Model, unknowns: jax.Array, initial: jax.Array, commands: jax.Array, step: float
) -> jax.Array:
    """Outputs (N, 12) with the unknowns, derivatives' errors then initial states', added to their nominal values."""
    names = parameters.names(layout)
    index = jnp.array([names.index(f"derivative_error.{name}") for name in layout.derivatives])
    theta = jnp.asarray(parameters.neutral(layout)).at[index].add(unknowns[: index.size])
    start = jnp.asarray(initial).at[jnp.array(_INITIAL)].add(unknowns[index.size :])
    calm = jnp.zeros((commands.shape[0], 6))
    inputs = Inputs(commands, calm, calm, jnp.zeros((commands.shape[0], len(OUTPUTS))))
    return rollout(layout, model, theta, start, inputs, jnp.asarray(step)).outputs


_slopes = jax.jit(jax.jacfwd(outputs_of, argnums=2), static_argnums=0)


def _check_travel(aircraft: Aircraft, manoeuvre: Manoeuvre, commands: Array) -> None:
    """Raise InputError where trim and manoeuvre together pass a control's limit, naming it and the time."""
    limits = [control.limit or np.inf for control in aircraft.controls.values()]
    for i, (name, limit) in enumerate(zip(aircraft.controls, limits, strict=True)):
        worst = int(np.abs(commands[:, i]).argmax())
        if abs(commands[worst, i]) > limit * (1 + 1e-9):
            raise InputError(
                f"manoeuvre {manoeuvre.spec!r}: trim included, {name} reaches {commands[worst, i]:.4g} rad at "
                f"{manoeuvre.time[worst]:.2f} s, but {aircraft.name}'s limit is {limit:g}; lower the amplitude"
            )
