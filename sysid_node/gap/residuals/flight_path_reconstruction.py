"""Flight path reconstruction: air data and attitude predicted from the inertial instruments, without aerodynamics.

Near zero frequency, forces and moments contain little information, and an error of an instrument looks like an error of
the derivatives. The kinematics contain no derivatives: specific force and angular rates, integrated, must give the
measured airspeed, flow angles and attitude (Klein & Morelli (2006), Aircraft System Identification, ch. 10).

An observer keeps the integral from drifting: each prediction is corrected by a share of its error before the next one
is made. What is compared are therefore innovations, in which each error counts once. The best time constant of the
observer depends on the air: in turbulence the last reading says more about the wind than an integral over seconds.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import export

from sysid_node.dynamics.airflow import flow_angles, flow_rates, velocity_of
from sysid_node.dynamics.lever_arm import specific_force_from, velocity_at, velocity_from
from sysid_node.dynamics.rigid_body import kinematic_rates
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.record import FlightRecord
from sysid_node.gap.flightdata.inferred_flow import FilterSteps, inferred_velocity
from sysid_node.sim.effects import air_data_lag, imu_misalignment
from sysid_node.sim.effects.actuator_lag import first_order_series
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar, Values
from sysid_node.sim.model.parameters import Parameters
from sysid_node.sim.prediction.active_effects import evaluate_if
from sysid_node.sim.signals.time_shift import shift_cubic, slope
from sysid_node.sim.stations import sensors

#: Columns of ``reconstruct``: m/s and rad.
READINGS = ("V", "alpha", "beta", "phi", "theta", "psi")

#: Time constant with which the observer corrects the attitude, s; the wind does not disturb it.
_ATTITUDE_MEMORY = 4.0


#: Times that the air's rotation is taken off the flow at a probe ahead of the CG.
_PASSES = 2


class InstrumentReadings(NamedTuple):
    """Readings of the instruments, N samples at a constant rate, at the times of the messages' stamps."""

    force: Scalar  # (N, 3) specific force, m/s^2
    rates: Scalar  # (N, 3) rad/s
    turning: Scalar  # (N, 3) rad/s^2
    air: Scalar  # (N, 3) V m/s, alpha, beta rad
    attitude: Scalar  # (N, 3) phi, theta, psi rad, without jumps
    inference: FilterSteps | None = None  # how flow angles that no vane measured are inferred


class _Inertial(NamedTuple):
    """The motion by the inertial instruments, corrected for their errors."""

    force: Vector  # specific, at the CG
    rates: Vector
    turning: Vector  # rad/s^2
    attitude: Vector  # Euler angles


class Sample(NamedTuple):
    """The motion at one sample, or at a series of them, corrected for the sensors' effects."""

    force: Vector  # specific, at the CG
    rates: Vector
    velocity: Vector  # relative to the air, at the CG, by the air data
    attitude: Vector  # Euler angles
    flow: Scalar  # (..., 3) airspeed, alpha, beta at the probe
    probe: Scalar  # (..., 3) output of the lagged probe


class _State(NamedTuple):
    """State of the observer."""

    velocity: Vector
    attitude: Vector
    probe: Scalar  # (3,) output of the lagged probe
    truth: Scalar  # (3,) the flow at the probe


def motion_of(record: FlightRecord) -> InstrumentReadings | None:
    """The readings of a record, angular accelerations included; None without roll and pitch angle.

    A heading that was not measured is set to zero: nothing but its own prediction depends on it.
    """
    if not all(np.isfinite(record[name]).all() for name in ("phi", "theta")):
        return None

    measured = bool(np.isfinite(record["psi"]).all())
    heading = jnp.asarray(record["psi"] if measured else np.zeros(len(record)))

    def columns(*names: str) -> Scalar:
        return jnp.asarray(np.column_stack([record[name] for name in names]))

    return InstrumentReadings(
        columns("ax", "ay", "az"),
        columns("p", "q", "r"),
        columns("p_rate", "q_rate", "r_rate"),
        columns(*READINGS[:3]),
        jnp.unwrap(jnp.column_stack([columns("phi", "theta"), heading]), axis=0),
    )


def reconstruct(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Parameters,
    motion: InstrumentReadings,
    memory: Scalar | float,
    step: Scalar,
) -> Scalar:
    """Readings (N, 6), columns ``READINGS``, that parameters (P,) predict, each from the samples before it.

    ``memory`` is the time constant of the observer of the air, s; ``step`` the sample period, s. Pure.
    """
    chain = Chain.of(layout, model, theta, step, jnp.zeros(()))
    samples = corrected_motion(chain, motion)
    first = jax.tree.map(lambda series: series[0], samples)
    flow = _at_probe(chain, first.velocity, first.rates)
    start = _State(first.velocity, first.attitude, flow, flow)
    before = jax.tree.map(lambda series: jnp.concatenate([series[:1], series[:-1]]), samples)
    known = jnp.arange(motion.air.shape[0]) * step
    steps = (before, samples, jnp.minimum(known, memory), jnp.minimum(known, _ATTITUDE_MEMORY))
    _, rows = jax.lax.scan(lambda state, sample: _advance(chain, state, *sample), start, steps)
    air, attitude = rows[:, :3], rows[:, 3:]
    late_air, late_imu = (chain.effects[name]["delay"] / step for name in ("air_data_delay", "imu_delay"))
    return jnp.concatenate([shift_cubic(air, late_air), shift_cubic(attitude, late_imu)], axis=1)


def corrected_motion(chain: Chain, motion: InstrumentReadings) -> Sample:
    """The motion (N,) without the sensors' effects of a parameter vector, at the time of the samples."""
    inertial, reading = _inertial(chain, motion), _reading(chain, motion)
    flow = sensors.before_lag(chain.effects, reading, _flow_rate(chain, inertial, reading), chain.step)
    velocity = Vector(*velocity_from(velocity_of(flow.T, jnp), inertial.rates, _probe(chain)))
    if motion.inference is not None:
        bias = chain.effects["vane_bias"]["alpha"], chain.effects["vane_bias"]["beta"]
        velocity = inferred_velocity(motion.inference, inertial.force, inertial.rates, velocity, bias)
        flow = _at_probe(chain, velocity, inertial.rates)
        reading = jnp.where(jnp.append(0.0, motion.inference.inferred) > 0.0, flow, reading)
    return Sample(inertial.force, inertial.rates, velocity, inertial.attitude, flow, reading)


class Flow(NamedTuple):
    """The flow at the time of the samples, its rate of change, and the rotation of the air."""

    velocity: Vector  # (N,) relative to the air at the CG, m/s
    alpha_rate: Scalar  # (N,) rad/s at the CG
    air_rotation: Vector  # (N,) of the air about body axes, rad/s, where the vanes show it


export.register_namedtuple_serialization(Flow, serialized_name="sysid.Flow")


def flow_of(chain: Chain, motion: InstrumentReadings, memory: Scalar | float, vanes: Scalar) -> Flow:
    """The flow by the inertial instruments, corrected by the vanes with a time constant ``memory``, s.

    Only the vanes show gusts: with a memory of zero they are followed at every sample. In still air their noise would
    pass for motion, and noise in a regressor biases derivatives toward zero, the more so the less the aircraft moves.
    ``vanes`` (2,) is one where alpha and beta were measured, and zero elsewhere.
    """
    samples = corrected_motion(chain, motion)

    def followed() -> Flow:
        moving, _ = kinematic_rates(samples.velocity, samples.attitude, samples.force, samples.rates, jnp)
        velocity, rate = _followed(samples.velocity, moving, memory, chain.step)
        _, alpha_rate, _ = flow_rates(velocity, rate, jnp)
        still = jnp.zeros_like(alpha_rate)
        return Flow(velocity, alpha_rate, Vector(still, still, still))

    return evaluate_if(jnp.asarray(memory) > 0.0, followed, lambda: _in_turning_air(chain, samples, vanes))


def _in_turning_air(chain: Chain, samples: Sample, vanes: Scalar) -> Flow:
    """The flow that the vanes show, at the CG of an aircraft in air that turns.

    A probe ahead of the CG also measures the air's rotation, which follows from the flow at the CG: so both are
    computed twice.
    """
    arm, at_probe = _probe(chain), Vector(*velocity_of(samples.flow.T, jnp))
    velocity, rotation = samples.velocity, _air_rotation(chain, samples, samples.velocity, vanes)
    for _ in range(_PASSES):
        velocity = Vector(*velocity_from(at_probe, samples.rates.minus(rotation), arm))
        rotation = _air_rotation(chain, samples, velocity, vanes)
    _, alpha, _ = flow_angles(velocity, jnp)
    return Flow(velocity, slope(alpha, chain.step), rotation)


def _air_rotation(chain: Chain, samples: Sample, velocity: Vector, vanes: Scalar) -> Vector:
    """The rotation (N,) of the air, rad/s, from the rates of the flow angles that no motion of the aircraft explains.

    Gusts that the aircraft flies through turn it by their gradient along the path, d/dx = 1/V d/dt in frozen
    turbulence, and its span smooths them (MIL-F-8785C (1980), q_g and r_g of the Dryden form).
    Nothing shows rolling gusts.
    """
    moving, _ = kinematic_rates(velocity, samples.attitude, samples.force, samples.rates, jnp)
    _, *by_motion = flow_rates(velocity, moving, jnp)
    speed, *angles = flow_angles(velocity, jnp)
    unexplained = [slope(angle, chain.step) - rate for angle, rate in zip(angles, by_motion, strict=True)]
    size = chain.model.span / (jnp.pi * speed.mean())
    pitch, yaw = (
        share * first_order_series(lag * size, rate, chain.step, jnp.zeros(()))
        for share, lag, rate in zip(vanes, (4.0, 3.0), unexplained, strict=True)
    )
    return Vector(jnp.zeros_like(speed), pitch, -yaw)


def _followed(seen: Vector, moving: Vector, memory: Scalar | float, step: Scalar) -> tuple[Vector, Vector]:
    """A velocity (N,) seen by the vanes, smoothed with its rate by the inertial instruments; and the smoothed rate.

    The difference of the two is fitted by a straight line over the memory, so that a constant error of an accelerometer
    leaves nothing (the alpha-beta filter of Benedict & Bordner (1962), IRE Trans. Automatic Control 7(4), with the
    gains of a line through n samples).
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

    # one array of rows: with several series XLA would copy each of them whole at every step
    table = jnp.concatenate([level[:, None], tilt[:, None], gained, readings], axis=1)
    _, velocity = jax.lax.scan(advance, jnp.concatenate([readings[0], jnp.zeros(3)]), table)
    beyond = (velocity - jnp.concatenate([readings[:1], velocity[:-1]]) - gained) / step
    return Vector(*velocity.T), Vector(*(rates + beyond).T)


def _flow_rate(chain: Chain, inertial: _Inertial, reading: Scalar) -> Scalar:
    """Rates of change (N, 3) of airspeed and flow angles at the probe."""
    force, rates, turning, attitude = inertial
    velocity, probe = velocity_of(reading.T, jnp), _probe(chain)
    moving, _ = kinematic_rates(Vector(*velocity_from(velocity, rates, probe)), attitude, force, rates, jnp)
    return jnp.stack(flow_rates(velocity, velocity_at(moving, turning, probe), jnp), axis=1)


def _inertial(chain: Chain, motion: InstrumentReadings) -> _Inertial:
    """The motion (N,) by gyroscopes, accelerometers and attitude, moved to the CG."""
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


def _reading(chain: Chain, motion: InstrumentReadings) -> Scalar:
    """The flow (N, 3) that the probe would have read with no error but its lag."""
    late = chain.effects["air_data_delay"]["delay"] / chain.step
    return jnp.stack(sensors.flow_from(chain.effects, *shift_cubic(motion.air, -late).T), 1)


def _probe(chain: Chain) -> Vector:
    """Position of the air data probe relative to the CG, m."""
    return sensors.air_data_arm(chain.model, chain.effects, chain.body)


def _unscaled(effects: dict[str, Values], reading: Vector, names: tuple[str, str, str]) -> Vector:
    """A reading without scale errors and misalignment."""
    scale = effects["imu_scale"]
    true = Vector(*(part / (1.0 + scale[name]) for part, name in zip(reading, names, strict=True)))
    return imu_misalignment.undo(effects["imu_misalignment"], true)


def _advance(
    chain: Chain, state: _State, before: Sample, now: Sample, air_memory: Scalar, attitude_memory: Scalar
) -> tuple[_State, Scalar]:
    """The observer's state after one sample, and the readings (6,) that it predicted for it.

    Memories (s) grow from zero with the flight: otherwise the first reading's noise would stay for as long.
    """
    h = chain.step
    k1 = kinematic_rates(state.velocity, state.attitude, before.force, before.rates, jnp)
    middle = (state.velocity.plus(k1[0].times(h)), state.attitude.plus(k1[1].times(h)))
    k2 = kinematic_rates(*middle, now.force, now.rates, jnp)
    velocity = state.velocity.plus(k1[0].plus(k2[0]).times(0.5 * h))
    attitude = state.attitude.plus(k1[1].plus(k2[1]).times(0.5 * h))
    truth = _at_probe(chain, velocity, now.rates)
    probe = air_data_lag.advance(chain.effects["air_data_lag"], state.probe, state.truth, truth, h)
    reading = jnp.stack([*sensors.air_data(chain.effects, *probe), *attitude])
    velocity = velocity.plus(now.velocity.minus(velocity).times(h / (air_memory + h)))
    attitude = attitude.plus(now.attitude.minus(attitude).times(h / (attitude_memory + h)))
    return _State(velocity, attitude, probe, truth), reading


def _at_probe(chain: Chain, velocity: Vector, rates: Vector) -> Scalar:
    """Airspeed, alpha and beta (..., 3) at the probe."""
    return jnp.stack(sensors.at_probe(velocity, rates, _probe(chain)), axis=-1)
