"""Multiple shooting: the simulator beside a flight, started again every few samples from the measured state.

Short flights show the dynamics before drift hides them. Each starts with the velocity, attitude and angular rates that
the instruments measured there (low-passed with zero phase, the sensors' effects removed). Actuators, motor, flow
separation and structure keep their states. The air moves as the air data show it beyond the inertial instruments,
integrated from the start of the short flight. Gusts, and the vanes' noise with them, are thus an input of the simulator
and not its error, and the error of a flow angle is that of the simulator's own motion.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.dynamics.atmosphere import altitude_of
from sysid_node.dynamics.attitude import quaternion
from sysid_node.dynamics.rigid_body import kinematic_rates
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import Array
from sysid_node.gap.residuals.flight_path_reconstruction import (
    InstrumentReadings,
    Sample,
    corrected_motion,
)
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.sim.compiled.programs import kept, result_type
from sysid_node.sim.flying.rollout import Pilot, StepState, advance, begin
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import OUTPUTS, AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.prediction.carried_states import actuators_of
from sysid_node.sim.signals.time_shift import shift_cubic
from sysid_node.sim.stations import command


class Course(NamedTuple):
    """A flight to be simulated, N samples at a constant rate."""

    motion: InstrumentReadings
    commands: Scalar  # (N, controls + 1) rad, thrust N, as recorded
    unfiltered: Scalar  # (N, K, controls) rad, before the low-pass, see ``MeasuredSignals``
    altitude: Scalar  # (N,) m, at which the standard air has the density that was measured
    moving: Scalar  # (N, 3) velocity of the air that is added to what the air data show, m/s
    turning: Scalar  # (N, 3) rotation of the air, rad/s
    begins: Scalar  # (N,) whether a short flight begins here
    time: Scalar  # (N,) s since the recording began


_ANGLES = tuple(OUTPUTS.index(name) for name in ("phi", "psi"))


class _Start(NamedTuple):
    """The state that a short flight would start with, at every sample."""

    begins: Scalar
    body: Scalar  # (13,)
    truth: Scalar  # (3,) flow at the probe one sample before
    probe: Scalar  # (3,) what the lagged probe held then


@result_type
class Readings(NamedTuple):
    """Readings of the simulator and of the flight, N samples at the time of the motion, columns ``layout.OUTPUTS``.

    Measured readings are shifted where the parameters say that messages are late.
    """

    simulated: Scalar  # (N, 12)
    measured: Scalar  # (N, 12)
    air: Scalar  # (N, 3) velocity of the air along body axes since the short flight began, m/s


@kept(1)
def fly(layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, course: Course, step: Scalar) -> Readings:
    """The readings with parameters (P,) beside a flight; a pure function of arrays, compiled."""
    chain = Chain.of(layout, model, theta, step, course.altitude[0])
    samples = corrected_motion(chain, course.motion)
    moved = actuators_of(chain, course.unfiltered)
    thrust = command.arrive(layout, chain.effects, course.commands, step)[:, -1:]
    arriving, chain = jnp.concatenate([moved, thrust], axis=1), chain.without_servos()
    air = _air(samples, course.begins, step)
    gusts = jnp.concatenate([air + course.moving, course.turning], axis=1)
    starts = _starts(samples, course)
    first, _ = begin(chain, starts.body[0], arriving[0], gusts[0], (), course.time[0])
    coming = (starts, gusts, _next(arriving), _next(gusts), course.time + step)
    _, (readings, *_) = jax.lax.scan(lambda carry, new: _advance(chain, carry, *new), first, coming)
    return Readings(readings, _measured(chain, course.motion), air)


def _advance(
    chain: Chain, carry: StepState, start: _Start, gusts: Scalar, command_: Scalar, next_gusts: Scalar, time: Scalar
) -> tuple[StepState, tuple[Scalar, ...]]:
    """One sample: the start of a short flight where one begins, the readings, and the integration up to ``time``."""

    def fresh(new: Scalar, old: Scalar) -> Scalar:
        return jnp.where(start.begins, new, old)

    carry = carry._replace(
        x=fresh(carry.x.at[:13].set(start.body), carry.x),
        drive=carry.drive._replace(gusts=fresh(gusts, carry.drive.gusts)),
        truth=fresh(start.truth, carry.truth),
        probe=fresh(start.probe, carry.probe),
    )
    follow: Pilot = lambda state, outputs, planned: (planned, planned, state)  # noqa: E731
    return advance(chain, follow, carry, command_, next_gusts, time, jnp.zeros(12))


def _starts(samples: Sample, course: Course) -> _Start:
    """The measured state at every sample."""
    origin = jnp.zeros_like(course.altitude)
    attitude = quaternion(samples.attitude, jnp)
    columns = (origin, origin, -course.altitude, *samples.velocity, *attitude, *samples.rates)
    return _Start(course.begins, jnp.stack(columns, 1), _previous(samples.flow), _previous(samples.probe))


def _air(samples: Sample, begins: Scalar, step: Scalar) -> Scalar:
    """Velocity of the air (N, 3) along body axes since the short flight began, m/s.

    It is the integral of specific force and gravity minus the velocity that the air data show.
    """
    shown = jnp.stack(samples.velocity, 1)

    def integrate(held: Scalar, new: tuple[Sample, Sample, Scalar]) -> tuple[Scalar, Scalar]:
        before, now, anew = new
        k1, _ = kinematic_rates(Vector(*held), before.attitude, before.force, before.rates, jnp)
        k2, _ = kinematic_rates(Vector(*held).plus(k1.times(step)), now.attitude, now.force, now.rates, jnp)
        ahead = held + 0.5 * step * jnp.stack(k1.plus(k2))
        moved = jnp.where(anew, jnp.stack(now.velocity), ahead)
        return moved, moved

    pairs = (jax.tree.map(_previous, samples), samples, begins)
    _, inertial = jax.lax.scan(integrate, shown[0], pairs)
    return jnp.asarray(inertial - shown)


def _measured(chain: Chain, motion: InstrumentReadings) -> Scalar:
    """Readings (N, 12) as recorded, moved to when the parameters say that they were taken."""
    late = [chain.effects[name]["delay"] / chain.step for name in ("imu_delay", "air_data_delay")]
    inertial = shift_cubic(jnp.concatenate([motion.force, motion.rates, motion.attitude], axis=1), -late[0])
    return jnp.concatenate([inertial, shift_cubic(motion.air, -late[1])], axis=1)


def _next(series: Scalar) -> Scalar:
    """A series (N, ...) one sample later, its last sample twice."""
    return jnp.concatenate([series[1:], series[-1:]])


def _previous(series: Scalar) -> Scalar:
    """A series (N, ...) one sample earlier, its first sample twice."""
    return jnp.concatenate([series[:1], series[:-1]])


def course_of(model: ResidualModel, size: int) -> Course:
    """The course of a model's flight with short flights of ``size`` samples, padded as the model's signals are.

    The flight must have attitude (``readings.can_be_simulated``).
    """
    given = model.inputs
    altitude = jnp.asarray([altitude_of(density) for density in np.asarray(given.signals.density).tolist()])
    begins = jnp.arange(altitude.size) % size == 0
    still = jnp.zeros((altitude.size, 3))
    assert given.motion is not None
    assert given.signals.unfiltered is not None
    commands, unfiltered = given.signals.commands, given.signals.unfiltered
    return Course(given.motion, commands, unfiltered, altitude, still, still, begins, given.signals.time)


@result_type
class Beginnings(NamedTuple):
    """What short flights of any simulator are flown with and read by, N samples (arrays)."""

    body: Array  # (N, 13) the state with which a short flight would begin, ``sim.model.state.STATES``
    air: Array  # (N, 3) velocity of the air along body axes since the short flight began, m/s
    commands: Array  # (N, controls + 1) at the time of the motion, rad, thrust N
    measured: Array  # (N, 12) readings at the time of the motion, columns ``layout.OUTPUTS``


@kept(1)
def _beginnings(
    layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, course: Course, step: Scalar
) -> Beginnings:
    chain = Chain.of(layout, model, theta, step, course.altitude[0])
    samples = corrected_motion(chain, course.motion)
    arriving = command.arrive(layout, chain.effects, course.commands, step)
    parts = (_starts(samples, course).body, _air(samples, course.begins, step), arriving)
    return Beginnings(*parts, _measured(chain, course.motion))  # type: ignore[arg-type]


def beginnings(model: ResidualModel, theta: Array, course: Course) -> Beginnings:
    """The states, air, commands and readings of a flight, as the instruments' effects of parameters (P,) have them."""
    s, samples = model.simulator, len(model.record)
    found = _beginnings(s.layout, s.model, jnp.asarray(theta), course, jnp.asarray(s.step))
    return Beginnings(*(np.asarray(series)[:samples] for series in found))


def simulate_beside(model: ResidualModel, theta: Array, course: Course) -> tuple[Array, Array, Array]:
    """Simulated readings (N, 12), measured ones (N, 12) and the air's motion (N, 3), as in ``Readings``."""
    s, samples = model.simulator, len(model.record)
    readings = fly(s.layout, s.model, jnp.asarray(theta), course, jnp.asarray(s.step))
    simulated, measured, air = (np.asarray(series)[:samples] for series in readings)
    return simulated, measured, air


def simulation_error(model: ResidualModel, theta: Array, course: Course) -> Array:
    """Measured minus simulated readings (N, 12) for parameters (P,); angles within half a turn."""
    simulated, measured, _ = simulate_beside(model, theta, course)
    return without_jumps(measured - simulated)


def without_jumps(error: Array) -> Array:
    """Errors of readings (N, 12) with those of roll and heading within half a turn."""
    error = error.copy()
    error[:, _ANGLES] = (error[:, _ANGLES] + np.pi) % (2.0 * np.pi) - np.pi
    return error
