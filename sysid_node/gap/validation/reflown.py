"""The gap as flown in another simulator: short flights there, before and after the correction of its model.

The short flights, their measure and the noise floor are those of ``simulation_error``. What lies in the flight's
instruments and clocks is not the simulator's: the effects found there are taken out of the measured states and put
into the readings of both models alike, so that the two errors differ by the model alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.dynamics.airflow import flow_angles
from sysid_node.dynamics.attitude import euler_angles
from sysid_node.dynamics.lever_arm import specific_force_at, velocity_at
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.short_flights.multiple_shooting import Beginnings, beginnings, without_jumps
from sysid_node.gap.short_flights.readings import can_be_simulated, course_of_flight
from sysid_node.gap.validation.simulation_error import SideBySide, gap_of_errors, mean_squares
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.sim.effects import EFFECTS
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import OUTPUTS, AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.stations import sensors

#: Stations of the flight's instruments; the air of a flight is none of a simulator's either.
INSTRUMENTS = ("sensors", "clock")


class CentreOfGravityMotion(Protocol):
    """The motion at the centre of gravity, N samples, in body axes forward-right-down."""

    @property
    def force(self) -> Array:
        """Specific force (N, 3), m/s^2."""

    @property
    def turning(self) -> Array:
        """Angular acceleration (N, 3), rad/s^2."""

    @property
    def rates(self) -> Array:
        """Angular rates (N, 3), rad/s."""

    @property
    def attitude(self) -> Array:
        """Roll, pitch and heading (N, 3), rad."""

    @property
    def velocity(self) -> Array:
        """Velocity relative to the air (N, 3), m/s."""


class Flyer(Protocol):
    """A simulator with one model."""

    def fly_short(self, begins: Array, body: Array, commands: Array, air: Array, rate: float) -> CentreOfGravityMotion:
        """Short flights from states (N, 13), with commands (N, controls + 1) and air (N, 3) m/s, at a rate, Hz."""


@dataclass(frozen=True)
class Reflown:
    """The gap as flown in the other simulator, and its flights."""

    gap: Gap
    flights: tuple[SideBySide, ...]


class _Shown(NamedTuple):
    force: Vector
    turning: Vector
    rates: Vector
    velocity: Vector


def reflown(models: Sequence[ResidualModel], thetas: Sequence[Array], before: Flyer, after: Flyer) -> Reflown | None:
    """The gap of flights with their corrected parameters (P,), as both simulators fly them.

    None where no flight can be flown in short flights, or a simulator cannot go on within one.
    """
    tables, flights = [], []
    for model, theta in zip(models, thetas, strict=True):
        if not can_be_simulated(model):
            continue
        course = course_of_flight(model)
        begins = np.asarray(course.begins)[: len(model.record)]
        instruments = _chosen(model, theta, INSTRUMENTS)
        masses = _chosen(model, theta, (*INSTRUMENTS, "mass"))
        measured = beginnings(model, instruments, course).measured
        shown = [_flown(model, flyer, point, beginnings(model, point, course), begins)
                 for flyer, point in ((before, instruments), (after, masses))]  # fmt: skip
        if not all(np.isfinite(readings).all() for readings in shown):
            return None
        errors = [without_jumps(measured - readings) for readings in shown]
        flights.append(SideBySide(model.time, measured, measured - errors[0], measured - errors[1], begins))
        tables.append(mean_squares(model, theta, course, measured, [errors[0], errors[0], errors[1]]))
    gap = gap_of_errors(models, tables)
    return None if gap is None else Reflown(gap, tuple(flights))


def _chosen(model: ResidualModel, theta: Array, stations: tuple[str, ...]) -> Array:
    """The aircraft file's parameters (P,) with the effects of some stations as they were found."""
    chosen = model.simulator.neutral().copy()
    for i, name in enumerate(model.simulator.names):
        if EFFECTS[name.partition(".")[0]].station in stations:
            chosen[i] = theta[i]
    return chosen


def _flown(model: ResidualModel, flyer: Flyer, theta: Array, known: Beginnings, begins: Array) -> Array:
    """Readings (N, 12) that instruments with the effects of parameters (P,) have in another simulator's flight."""
    motion = flyer.fly_short(begins, known.body, known.commands, known.air, model.simulator.rate)
    vectors = [Vector(*map(jnp.asarray, x.T)) for x in (motion.force, motion.turning, motion.rates, motion.velocity)]
    s = model.simulator
    inertial, air = _read(s.layout, s.model, jnp.asarray(theta), _Shown(*vectors), jnp.asarray(begins),
                          jnp.asarray(s.step))  # fmt: skip
    heading = known.body[:, 6:10].T
    measured_attitude = np.column_stack(euler_angles(tuple(heading), np))
    attitude = motion.attitude.copy()
    # the other simulator starts each short flight with its own heading
    starts = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
    attitude[:, 2] += (measured_attitude[:, 2] - attitude[:, 2])[starts]
    readings = np.column_stack([np.asarray(inertial), attitude, np.asarray(air)])
    assert readings.shape[1] == len(OUTPUTS)
    return readings


@partial(jax.jit, static_argnums=0)
def _read(
    layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, shown: _Shown, begins: Scalar, step: Scalar
) -> tuple[Scalar, Scalar]:
    """Readings of the inertial instruments (N, 6) and of the air data (N, 3)."""
    chain = Chain.of(layout, model, theta, step, jnp.zeros(()))
    force = specific_force_at(
        shown.force, shown.rates, shown.turning, sensors.imu_arm(model, chain.effects, chain.body)
    )
    inertial = (*sensors.accelerometers(chain.effects, force), *sensors.gyroscopes(chain.effects, shown.rates))
    probe = sensors.air_data_arm(model, chain.effects, chain.body)
    flow = jnp.stack(flow_angles(velocity_at(shown.velocity, shown.rates, probe), jnp), 1)

    def lag(state: Scalar, new: tuple[Scalar, Scalar, Scalar]) -> tuple[Scalar, Scalar]:
        anew, before, now = new
        late = jnp.where(anew, now, sensors.lagged(chain.effects, state, before, now, step))
        return late, late

    previous = jnp.concatenate([flow[:1], flow[:-1]])
    _, late = jax.lax.scan(lag, flow[0], (begins, previous, flow))
    air = sensors.air_data(chain.effects, late[:, 0], late[:, 1], late[:, 2])
    return jnp.stack(inertial, 1), jnp.stack(air, 1)
