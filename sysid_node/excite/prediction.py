"""The predicted information of a manoeuvre about an aircraft, from the simulator's Jacobian.

Klein & Morelli, "Aircraft System Identification" (2006), sect. 9.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import air_density
from sysid_node.errors import InputError
from sysid_node.excite.information import FisherInformation, eliminate, fisher
from sysid_node.excite.manoeuvre import THROTTLE, Manoeuvre, check_thrust
from sysid_node.excite.segment import ManoeuvreSegment, draw_manoeuvre
from sysid_node.flight.record import FlightRecord
from sysid_node.sim import RolloutInputs, SimulatedFlight, Simulator
from sysid_node.sim.compiled.programs import kept
from sysid_node.sim.flying.autopilot import autopilot_for, fly_held
from sysid_node.sim.flying.lengths import padded
from sysid_node.sim.flying.rollout import rollout
from sysid_node.sim.flying.trim import Trim, trim_flight
from sysid_node.sim.model import parameters
from sysid_node.sim.model.layout import OUTPUTS, AircraftNumbers, ParameterLayout

Array = NDArray[np.float64]

#: Outputs used in a prediction: all but the heading, on which the derivatives have little effect.
MEASURED = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "V", "alpha", "beta")

#: States of the simulator whose initial values count as unknown: all but position and one part of the attitude, which
#: a heading that is not measured leaves open.
_INITIAL = (3, 4, 5, 7, 8, 10, 11, 12)

#: Smallest effect on an output, in its sigmas for a unit change, that is not taken for a rounding error.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Prediction:
    """A manoeuvre, its simulated flight (no noise; controls as flown, autopilot included), and its information."""

    manoeuvre: Manoeuvre
    flight: FlightRecord
    information: FisherInformation


def tolerances_of(aircraft: Aircraft) -> Array:
    """The uncertainty of each derivative (P,), 1 sigma: the file's tolerance, else a tenth of its value, else one."""
    return np.array([d.tolerance or 0.1 * abs(d.value) or 1.0 for d in aircraft.derivatives.values()])


class Predictor:
    """Predictions for one aircraft from one trim.

    With ``autopilot`` the simulator's attitude hold is in the loop. Its deflections are part of the input then: the
    estimator is assumed to know the controls as flown, not the plan.
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

    @property
    def full_thrust(self) -> float:
        """N for one unit of the throttle: at full throttle, or one where it is in N."""
        throttle = self.aircraft.throttle
        return 1.0 if throttle is None or throttle.max_thrust is None else throttle.max_thrust

    def draw(self, segments: Sequence[ManoeuvreSegment], duration: float | None = None) -> Manoeuvre:
        """Segments as a manoeuvre at the predictor's rate, ``duration`` s long."""
        return draw_manoeuvre(segments, self.aircraft, self.simulator.rate, duration)

    def predict(self, manoeuvre: Manoeuvre) -> Prediction:
        """The prediction for a manoeuvre from trim. Raises InputError where a control saturates or it diverges."""
        flight = self._fly(self.commands(manoeuvre))
        with np.errstate(over="ignore", invalid="ignore"):  # a matrix that is not finite is refused below
            matrix = eliminate(fisher(self._slopes(np.asarray(flight.commands)), self._sigma), len(self.names))
        if not np.isfinite(matrix).all():
            raise InputError(
                f"a manoeuvre of {manoeuvre.time[-1]:.0f} s: the aircraft has an unstable mode, along which the "
                "sensitivities to the derivatives grow beyond any number; give a shorter duration"
            )
        information = FisherInformation(self.names, self.values, matrix)
        return Prediction(manoeuvre, self._record(manoeuvre, flight), information)

    def _record(self, manoeuvre: Manoeuvre, flight: SimulatedFlight) -> FlightRecord:
        columns = dict(zip(self.simulator.outputs, np.asarray(flight.outputs).T, strict=True))
        columns["rho"] = np.asarray(air_density(-flight.states[:, 2], jnp))
        controls = (*self.aircraft.control_symbols, "thrust")
        columns |= dict(zip(controls, np.asarray(flight.commands).T, strict=True))
        return FlightRecord(manoeuvre.time, columns, f"{self.aircraft.name} {manoeuvre.spec}")

    def commands(self, manoeuvre: Manoeuvre) -> Array:
        """Trim plus manoeuvre, (N, controls + 1): rad, and thrust in N."""
        still = np.zeros(manoeuvre.time.size)
        thrust = self.full_thrust * manoeuvre.deflections.get(THROTTLE, still)
        commands = np.asarray(self.trim.command + np.column_stack([manoeuvre.surfaces(), thrust]))
        _check_travel(self.aircraft, manoeuvre, commands)
        return commands

    def _fly(self, commands: Array) -> SimulatedFlight:
        simulator, inputs, theta = self.simulator, self.simulator.inputs(commands), self.simulator.neutral()
        if self.autopilot is None:
            flight = simulator.rollout(theta, self.trim.initial, inputs)
        else:
            flight = fly_held(simulator, theta, self.trim, inputs, self.autopilot)
        return simulator.check(flight)

    def _slopes(self, commands: Array) -> Array:
        """Sensitivities (N, m, derivatives + initial states) of the measured outputs; rounding errors become zero."""
        simulator, unknowns = self.simulator, np.zeros(len(self.names) + len(_INITIAL))
        arguments = (simulator.layout, simulator.model, unknowns, self.trim.initial, padded(commands), simulator.step)
        slopes = np.asarray(slopes_of(*arguments, simulator.neutral()))[: len(commands), self._columns]
        largest = np.abs(slopes / self._sigma[:, None]).max(axis=(0, 1))
        return np.where(largest > _ROUNDING, slopes, 0.0)


def outputs_of(
    layout: ParameterLayout,
    model: AircraftNumbers,
    unknowns: jax.Array,
    initial: jax.Array,
    commands: jax.Array,
    step: float,
    file: jax.Array,
) -> jax.Array:
    """Outputs (N, 12) with the unknowns, derivatives' errors then initial states', added to their nominal values.

    ``file`` (P,) are the effects of the aircraft file.
    """
    names = parameters.names(layout)
    index = jnp.array([names.index(f"derivative_error.{name}") for name in layout.derivatives])
    theta = jnp.asarray(file).at[index].add(unknowns[: index.size])
    start = jnp.asarray(initial).at[jnp.array(_INITIAL)].add(unknowns[index.size :])
    calm = jnp.zeros((commands.shape[0], 6))
    inputs = RolloutInputs(commands, calm, calm, jnp.zeros((commands.shape[0], len(OUTPUTS))))
    return rollout(layout, model, theta, start, inputs, jnp.asarray(step)).outputs


#: d ``outputs_of`` / d unknowns, (N, 12, unknowns).
slopes_of = kept(1)(jax.jacfwd(outputs_of, argnums=2))


def _check_travel(aircraft: Aircraft, manoeuvre: Manoeuvre, commands: Array) -> None:
    """Raise InputError where trim and manoeuvre together pass a control's limit, naming it and the time."""
    limits = {
        name: (-(control.limit or np.inf), control.limit or np.inf) for name, control in aircraft.controls.items()
    }
    check_thrust(manoeuvre, aircraft, commands[:, -1])
    for i, (name, (low, high)) in enumerate(limits.items()):
        beyond = np.maximum(low - commands[:, i], commands[:, i] - high)
        worst = int(beyond.argmax())
        if beyond[worst] > 1e-9:
            raise InputError(
                f"manoeuvre {manoeuvre.name!r}: trim included, {name} reaches {commands[worst, i]:.4g} at "
                f"{manoeuvre.time[worst]:.2f} s, but {aircraft.name} allows {low:g} to {high:g}; lower the amplitude"
            )
