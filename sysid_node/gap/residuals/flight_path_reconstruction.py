"""What air data and attitude should have read, given what the inertial instruments measured: no aerodynamics in it.

Forces and moments say little of what lives near zero frequency, and an instrument's error passes there as an error of
the derivatives. The motion's kinematics know no derivatives: specific force and rates, integrated, must give the
airspeed, flow angles and attitude that were measured (flight path reconstruction: Klein & Morelli (2006), ch. 10). An
observer keeps the integral from drifting: each prediction is corrected by a share of its error before the next, so that
what is compared are innovations, and the errors' history counts once. How fast it forgets depends on the air: in
turbulence the last reading says more about the wind than an integral over seconds.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import export

from sysid_node.dynamics.airflow import flow_angles, flow_rates, velocity_of
from sysid_node.dynamics.attitude import down_of_euler, euler_rates
from sysid_node.dynamics.lever_arm import specific_force_from, velocity_at, velocity_from
from sysid_node.dynamics.rigid_body import velocity_rate
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import FlightRecord
from sysid_node.sim.effects import air_data_lag, imu_misalignment
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import Layout, Model, Scalar, Values
from sysid_node.sim.model.parameters import Parameters
from sysid_node.sim.signals.time_shift import shift_cubic, slope
from sysid_node.sim.stations import sensors

#: Columns of ``reconstruct``: m/s and rad.
READINGS = ("V", "alpha", "beta", "phi", "theta", "psi")

#: Time after which the observer forgets the attitude, s; no wind moves it.
_ATTITUDE_FADING = 4.0


class Motion(NamedTuple):
    """What the instruments read, N samples at a constant rate, by the messages' stamps."""

    force: Scalar  # (N, 3) specific force, m/s^2
    rates: Scalar  # (N, 3) rad/s
    turning: Scalar  # (N, 3) rad/s^2
    air: Scalar  # (N, 3) V m/s, alpha, beta rad
    attitude: Scalar  # (N, 3) phi, theta, psi rad, without jumps


class _Inertial(NamedTuple):
    force: Vector  # specific, at the CG
    rates: Vector
    turning: Vector  # rad/s^2
    attitude: Vector  # Euler angles


class Sample(NamedTuple):
    """One sample of the motion, or a series of them, that the sensors' effects hide."""

    force: Vector  # specific, at the CG
    rates: Vector
    velocity: Vector  # relative to the air, at the CG, as the probe has it
    attitude: Vector  # Euler angles
    flow: Scalar  # (..., 3) airspeed, alpha, beta at the probe
    probe: Scalar  # (..., 3) what a lagged probe holds of them


class _State(NamedTuple):
    velocity: Vector
    attitude: Vector
    probe: Scalar  # (3,) what the lagged probe holds
    truth: Scalar  # (3,) the flow at the probe


def motion_of(record: FlightRecord) -> Motion | None:
    """A record's signals, with the rates' derivatives; None without roll and pitch angle.

    A heading that was not measured is zero: nothing but its own prediction depends on it.
    """
    if not all(np.isfinite(record[name]).all() for name in ("phi", "theta")):
        return None

    measured = bool(np.isfinite(record["psi"]).all())
    heading = jnp.asarray(record["psi"] if measured else np.zeros(len(record)))

    def columns(*names: str) -> Scalar:
        return jnp.asarray(np.column_stack([record[name] for name in names]))

    return Motion(
        columns("ax", "ay", "az"),
        columns("p", "q", "r"),
        columns("p_rate", "q_rate", "r_rate"),
        columns(*READINGS[:3]),
        jnp.unwrap(jnp.column_stack([columns("phi", "theta"), heading]), axis=0),
    )


def reconstruct(
    layout: Layout, model: Model, theta: Parameters, motion: Motion, fading: Scalar | float, step: Scalar
) -> Scalar:
    """Readings (N, 6), columns ``READINGS``, that parameters (P,) expect, each from the samples before it; pure."""
    chain = Chain.of(layout, model, theta, step, jnp.zeros(()))
    samples = corrected_motion(chain, motion)
    first = jax.tree.map(lambda series: series[0], samples)
    flow = _at_probe(chain, first.velocity, first.rates)
    start = _State(first.velocity, first.attitude, flow, flow)
    before = jax.tree.map(lambda series: jnp.concatenate([series[:1], series[:-1]]), samples)
    known = jnp.arange(motion.air.shape[0]) * step
    steps = (before, samples, jnp.minimum(known, fading), jnp.minimum(known, _ATTITUDE_FADING))
    _, rows = jax.lax.scan(lambda state, sample: _advance(chain, state, *sample), start, steps)
    air, attitude = rows[:, :3], rows[:, 3:]
    late_air, late_imu = (chain.effects[name]["delay"] / step for name in ("air_data_delay", "imu_delay"))
    return jnp.concatenate([shift_cubic(air, late_air), shift_cubic(attitude, late_imu)], axis=1)


def corrected_motion(chain: Chain, motion: Motion) -> Sample:
    """The motion (N,) that the readings tell of, at the time of the samples."""
    inertial, reading = _inertial(chain, motion), _reading(chain, motion)
    flow = sensors.before_lag(chain.effects, reading, _flow_rate(chain, inertial, reading), chain.step)
    velocity = velocity_from(velocity_of(flow.T, jnp), inertial.rates, _probe(chain))
    return Sample(inertial.force, inertial.rates, velocity, inertial.attitude, flow, reading)


class Flow(NamedTuple):
    """The flow at the time of the samples, and how fast it changes."""

    velocity: Vector  # (N,) relative to the air at the CG, m/s
    alpha_rate: Scalar  # (N,) rad/s at the CG


export.register_namedtuple_serialization(Flow, serialized_name="sysid.Flow")


def flow_of(chain: Chain, motion: Motion, memory: Scalar | float) -> Flow:
    """By the inertial instruments, with as much of what the vanes show beyond them as a memory (s) lets through.

    What gusts do, only the vanes show: without a memory they are followed at every sample. In still air their noise
    would pass for motion: in a regressor it makes derivatives seem smaller, the more so the less the aircraft moves.
    """
    samples = corrected_motion(chain, motion)
    moving, _ = rates_of_change(samples.velocity, samples.attitude, samples.force, samples.rates)
    velocity, rate = _followed(samples.velocity, moving, memory, chain.step)
    _, alpha_rate, _ = flow_rates(velocity, rate, jnp)
    _, alpha, _ = flow_angles(samples.velocity, jnp)
    followed, seen = Flow(velocity, alpha_rate), Flow(samples.velocity, slope(alpha, chain.step))
    flow: Flow = jax.tree.map(lambda a, b: jnp.where(memory > 0.0, a, b), followed, seen)
    return flow


def _followed(seen: Vector, moving: Vector, memory: Scalar | float, step: Scalar) -> tuple[Vector, Vector]:
    """A velocity (N,) as the vanes have it, from its rate by the inertial instruments, and its rate.

    A straight line through what the vanes show beyond that rate, over the memory: an accelerometer that is off by a
    constant leaves nothing (Benedict & Bordner (1962), IRE Trans. Automatic Control 7(4); the gains of a line through n
    samples).
    """
    readings, rates = jnp.stack(seen, 1), jnp.stack(moving, 1)
    gained = 0.5 * step * (rates + jnp.concatenate([rates[:1], rates[:-1]]))
    n = jnp.minimum(jnp.arange(seen.x.size) + 1.0, jnp.maximum(memory / step, 2.0))
    level, tilt = 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)), jnp.where(n < 2.0, 0.0, 6.0 / (n * (n + 1.0)))

    def advance(last: Scalar, sample: Scalar) -> tuple[Scalar, Scalar]:
        expected = last[:3] + last[3:] + sample[2:5]
        beyond = sample[5:] - expected
        now = expected + sample[0] * beyond
        return jnp.concatenate([now, last[3:] + sample[1] * beyond]), now

    # one row in, one row out: XLA would copy whole series at every step
    table = jnp.concatenate([level[:, None], tilt[:, None], gained, readings], axis=1)
    _, velocity = jax.lax.scan(advance, jnp.concatenate([readings[0], jnp.zeros(3)]), table)
    beyond = (velocity - jnp.concatenate([readings[:1], velocity[:-1]]) - gained) / step
    return Vector(*velocity.T), Vector(*(rates + beyond).T)


def _flow_rate(chain: Chain, inertial: _Inertial, reading: Scalar) -> Scalar:
    force, rates, turning, attitude = inertial
    velocity, probe = velocity_of(reading.T, jnp), _probe(chain)
    moving, _ = rates_of_change(velocity_from(velocity, rates, probe), attitude, force, rates)
    return jnp.stack(flow_rates(velocity, velocity_at(moving, turning, probe), jnp), axis=1)


def _inertial(chain: Chain, motion: Motion) -> _Inertial:
    """What gyroscopes, accelerometers and attitude tell (N,)."""
    effects, late = chain.effects, chain.effects["imu_delay"]["delay"] / chain.step
    force, rates, turning, attitude = (
        Vector(*shift_cubic(series, -late).T)
        for series in (motion.force, motion.rates, motion.turning, motion.attitude)
    )
    rates, turning = sensors.rates_from(effects, rates), _unscaled(effects, turning, ("p", "q", "r"))
    bias = effects["imu_bias"]
    felt = _unscaled(effects, force.minus(Vector(bias["ax"], bias["ay"], bias["az"])), ("ax", "ay", "az"))
    arm = sensors.imu_arm(chain.model, effects, chain.body)
    return _Inertial(specific_force_from(felt, rates, turning, arm), rates, turning, attitude)


def _reading(chain: Chain, motion: Motion) -> Scalar:
    """The flow (N, 3) that a probe without errors but its lag would have read."""
    late = chain.effects["air_data_delay"]["delay"] / chain.step
    return jnp.stack(sensors.flow_from(chain.effects, *shift_cubic(motion.air, -late).T), 1)


def _probe(chain: Chain) -> Vector:
    return sensors.air_data_arm(chain.model, chain.effects, chain.body)


def _unscaled(effects: dict[str, Values], reading: Vector, names: tuple[str, str, str]) -> Vector:
    """A vector without scale errors and misalignment."""
    scale = effects["imu_scale"]
    true = Vector(*(part / (1.0 + scale[name]) for part, name in zip(reading, names, strict=True)))
    return imu_misalignment.undo(effects["imu_misalignment"], true)


def _advance(
    chain: Chain, state: _State, before: Sample, now: Sample, air_memory: Scalar, attitude_memory: Scalar
) -> tuple[_State, Scalar]:
    """Predicts the readings (6,) of now, then corrects.

    Memories (s) begin with the flight: the first reading's noise would otherwise stay for as long as they are.
    """
    h = chain.step
    k1 = rates_of_change(state.velocity, state.attitude, before.force, before.rates)
    middle = (state.velocity.plus(k1[0].times(h)), state.attitude.plus(k1[1].times(h)))
    k2 = rates_of_change(*middle, now.force, now.rates)
    velocity = state.velocity.plus(k1[0].plus(k2[0]).times(0.5 * h))
    attitude = state.attitude.plus(k1[1].plus(k2[1]).times(0.5 * h))
    truth = _at_probe(chain, velocity, now.rates)
    probe = air_data_lag.advance(chain.effects["air_data_lag"], state.probe, state.truth, truth, h)
    reading = jnp.stack([*sensors.air_data(chain.effects, *probe), *attitude])
    velocity = velocity.plus(now.velocity.minus(velocity).times(h / (air_memory + h)))
    attitude = attitude.plus(now.attitude.minus(attitude).times(h / (attitude_memory + h)))
    return _State(velocity, attitude, probe, truth), reading


def rates_of_change(velocity: Vector, attitude: Vector, force: Vector, rates: Vector) -> tuple[Vector, Vector]:
    """Rates of the velocity's components (m/s^2) and of the Euler angles (rad/s)."""
    down = down_of_euler(attitude.x, attitude.y, jnp)
    return velocity_rate(force, down, rates, velocity), euler_rates(attitude.x, attitude.y, rates, jnp)


def _at_probe(chain: Chain, velocity: Vector, rates: Vector) -> Scalar:
    """Airspeed, alpha, beta (3,) where the probe sits."""
    return jnp.stack(sensors.at_probe(velocity, rates, _probe(chain)))
