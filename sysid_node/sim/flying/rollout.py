"""Simulated flights: the chain integrated over time by ``jax.lax.scan``.

Within a step surfaces, thrust and gusts are linear in time, and the classical fourth-order Runge-Kutta rule integrates
the body and the flow separation. Actuators, motor, lags and the structural mode are solved exactly from one sample to
the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from sysid_node.dynamics.attitude import euler_angles
from sysid_node.dynamics.lever_arm import specific_force_at
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.compiled.programs import result_type
from sysid_node.sim.effects import stall_separation
from sysid_node.sim.model.chain import Chain, Drive, SensedMotion, derivative, drive_of
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.model.state import body_state
from sysid_node.sim.stations import actuator, airflow, clock, command, propulsion, sensors, structure
from sysid_node.sim.stations.actuator import ActuatorState
from sysid_node.sim.stations.structure import Vibration


class RolloutInputs(NamedTuple):
    """Inputs of a flight; N samples at the simulator's rate."""

    commands: Scalar  # (N, controls + 1): surfaces rad, thrust N, by their recorded stamps
    gusts: Scalar  # (N, 6): velocity of the air along body axes m/s, its rotation rad/s
    turbulence: Scalar  # (N, 6): a realisation of intensity 1 m/s, scaled by the effect ``turbulence``
    noise: Scalar  # (N, 12): unit white noise, scaled by the effect ``sensor_noise``


@result_type
class SimulatedFlight(NamedTuple):
    """A simulated flight; N samples."""

    outputs: Scalar  # (N, 12) readings of the sensors, columns layout.OUTPUTS
    states: Scalar  # (N, 13) the body's true state, columns state.STATES
    surfaces: Scalar  # (N, controls + 1): true positions rad, thrust N
    commands: Scalar  # (N, controls + 1): as the pilot gives them, rad, N
    coefficients: Scalar  # (N, 6) true CL CD CY Cl Cm Cn about the file's CG


#: (pilot's state, outputs (12,) now, planned command (m,) of the next sample)
#: -> (command given, command that arrives at the actuators at the next sample, pilot's next state).
Pilot = Callable[[Any, Scalar, Scalar], tuple[Scalar, Scalar, Any]]


class StepState(NamedTuple):
    """What one step passes to the next."""

    x: Scalar  # (14,) the continuous state
    mode: Vibration  # of the structure, one sample before
    actuators: ActuatorState
    motor: Scalar  # thrust N
    motor_command: Scalar  # N
    drive: Drive
    truth: Scalar  # (3,) airspeed, alpha, beta at the probe one sample before
    probe: Scalar  # (3,) the same, lagged
    pilot: Any


def rollout(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Scalar,
    initial: Scalar,
    inputs: RolloutInputs,
    step: Scalar,
    samples: Scalar | int | None = None,
) -> SimulatedFlight:
    """The open-loop flight of parameters (P,) from the body's state (13,); pure. ``step`` is 1 / rate, s.

    Only the first ``samples`` count where the inputs are padded (see ``fly``).
    """
    chain = Chain.of(layout, model, theta, step, -initial[2])
    arriving = command.arrive(layout, chain.effects, inputs.commands, step)
    follow: Pilot = lambda state, outputs, planned: (planned, planned, state)  # noqa: E731
    flight = fly(chain, initial, inputs._replace(commands=arriving), follow, (), samples)
    return flight._replace(commands=inputs.commands)


def fly(
    chain: Chain,
    initial: Scalar,
    inputs: RolloutInputs,
    pilot: Pilot,
    pilot_state: Any,
    samples: Scalar | int | None = None,
) -> SimulatedFlight:
    """The flight that a pilot controls; ``inputs.commands`` are planned, ``pilot_state`` is the pilot's first.

    Where the inputs are padded, only the first ``samples`` count: stamps see the readings end there.
    """
    time = jnp.arange(inputs.commands.shape[0]) * chain.step
    gusts = airflow.gusts(chain.model, chain.effects, inputs.gusts, inputs.turbulence, time)
    coming = (_next(inputs.commands), _next(gusts), time + chain.step, inputs.noise)
    carry, surfaces = begin(chain, initial, inputs.commands[0], gusts[0], pilot_state, time[0])
    _, rows = jax.lax.scan(lambda c, new: advance(chain, pilot, c, *new), carry, coming)
    readings, states, coefficients, moved = rows
    if samples is not None:
        readings = readings[jnp.minimum(jnp.arange(readings.shape[0]), samples - 1)]
    stamped = clock.stamp(chain.effects, _continuous_angles(readings), chain.step)
    outputs = sensors.noisy(chain.model, chain.effects, stamped, inputs.noise)
    surfaces, commands = jnp.split(_previous(jnp.concatenate([surfaces, inputs.commands[0]]), moved), 2, axis=1)
    return SimulatedFlight(outputs, states, surfaces, commands, coefficients)


def advance(
    chain: Chain, pilot: Pilot, carry: StepState, planned: Scalar, gusts: Scalar, time: Scalar, noise: Scalar
) -> tuple[StepState, tuple[Scalar, ...]]:
    """The state after one step, to ``time`` (s) of the next sample, and a row of results.

    The row holds readings (12,), state (13,) and coefficients (6,) at present, and surfaces and command of the next
    sample as one array: as two arrays, or in the state, XLA would copy the whole series of commands at every step.
    """
    h = chain.step
    k1, motion = derivative(chain, carry.x, carry.drive)
    mode = structure.advance(chain.effects, carry.mode, motion.specific_force.z, h)
    truth, probe, reading = _read(chain, carry, motion, mode)
    seen = sensors.noisy(chain.model, chain.effects, reading, noise)
    given, arriving, pilot_state = pilot(carry.pilot, seen, planned)
    actuators = actuator.advance(
        chain.layout, chain.model, chain.effects, chain.servos, carry.actuators, arriving[:-1], h
    )
    motor_command = propulsion.commanded(chain.model, arriving[-1])
    motor = propulsion.advance(chain.effects, carry.motor, carry.motor_command, motor_command, h)
    drive, surfaces = drive_of(chain, actuators.position, motor, gusts, time)
    x = _runge_kutta(chain, carry.x, k1, carry.drive, drive)
    moved = jnp.concatenate([surfaces, given])
    row = (reading, carry.x[:13], jnp.stack(motion.coefficients), moved)
    return StepState(x, mode, actuators, motor, motor_command, drive, truth, probe, pilot_state), row


#: Stages 2 to 4 of the classical rule: the time of each as a share of the step, and its weight.
_STAGES = ((0.5, 2.0), (0.5, 2.0), (1.0, 1.0))


def _runge_kutta(chain: Chain, x: Scalar, k1: Scalar, now: Drive, then: Drive) -> Scalar:
    """The state (14,) after one classical fourth-order step; k1 is the rate at (x, now).

    The drive is linear from ``now`` to ``then``. With a loop in place of four calls the compiled program is a third as
    large and not slower.
    """
    h = chain.step

    def stage(carry: tuple[Scalar, Scalar], at: Scalar) -> tuple[tuple[Scalar, Scalar], None]:
        k, total = carry
        share, weight = at
        drive = Drive(*(a + share * (b - a) for a, b in zip(now, then, strict=True)))
        k, _ = derivative(chain, x + share * h * k, drive)
        return (k, total + weight * k), None

    (_, total), _ = jax.lax.scan(stage, (k1, k1), jnp.array(_STAGES))
    return x + h / 6.0 * total


def _read(chain: Chain, carry: StepState, motion: SensedMotion, mode: Vibration) -> tuple[Scalar, Scalar, Scalar]:
    """The true air data (3,) at the probe, the same after its lag (3,), and all readings (12,) without noise."""
    state = body_state(carry.x)
    truth = _at_probe(chain, motion)
    probe = sensors.lagged(chain.effects, carry.probe, carry.truth, truth, chain.step)
    reading = jnp.stack(
        [
            *_inertial(chain, state.rates, motion, mode),
            *euler_angles(state.attitude, jnp),
            *sensors.air_data(chain.effects, probe[0], probe[1], probe[2]),
        ]
    )
    return truth, probe, reading


def _inertial(chain: Chain, rates: Vector, motion: SensedMotion, mode: Vibration) -> tuple[Scalar, ...]:
    """Readings of accelerometers (m/s^2) and gyroscopes (rad/s)."""
    arm = sensors.imu_arm(chain.model, chain.effects, chain.body)
    force = specific_force_at(motion.specific_force, rates, motion.acceleration, arm)
    shake, nod = structure.felt(chain.effects, structure.acceleration(chain.effects, mode), mode.speed)
    return (
        *sensors.accelerometers(chain.effects, force._replace(z=force.z + shake)),
        *sensors.gyroscopes(chain.effects, rates._replace(y=rates.y + nod)),
    )


def _at_probe(chain: Chain, motion: SensedMotion) -> Scalar:
    """Airspeed (m/s), alpha, beta (rad) at the air-data probe, (3,)."""
    arm = sensors.air_data_arm(chain.model, chain.effects, chain.body)
    return jnp.stack(sensors.at_probe(motion.air.velocity, motion.air.rates, arm))


def begin(
    chain: Chain, initial: Scalar, planned: Scalar, gusts: Scalar, pilot_state: Any, time: Scalar
) -> tuple[StepState, Scalar]:
    """The state settled on the first sample's command and flow, and the surfaces and thrust (controls + 1,) there.

    ``time`` is that of the sample, s.
    """
    actuators = actuator.start(chain.model, planned[:-1])
    motor = propulsion.commanded(chain.model, planned[-1])
    drive, surfaces = drive_of(chain, actuators.position, motor, gusts, time)
    x = settled(chain, initial, drive)
    _, motion = derivative(chain, x, drive)
    truth = _at_probe(chain, motion)
    mode = structure.start(chain.effects, motion.specific_force.z)
    return StepState(x, mode, actuators, motor, motor, drive, truth, truth, pilot_state), surfaces


def settled(chain: Chain, initial: Scalar, drive: Drive) -> Scalar:
    """The continuous state (14,) of a body's state (13,), with flow separation at rest."""
    state = body_state(initial)
    air = airflow.meet(state.velocity, state.rates, drive.gusts, jnp.ones_like(chain.altitude))
    zero = jnp.zeros_like(air.alpha)
    attached = stall_separation.attached(chain.effects["stall_separation"], air.alpha, zero, zero)
    return jnp.append(initial, attached)


def _next(series: Scalar) -> Scalar:
    """The series one sample earlier: row k holds row k + 1, and the last row is repeated."""
    return jnp.concatenate([series[1:], series[-1:]])


def _previous(first: Scalar, series: Scalar) -> Scalar:
    """The series one sample later: row k holds row k - 1, and the first row is given."""
    return jnp.concatenate([first[None], series[:-1]])


def _continuous_angles(outputs: Scalar) -> Scalar:
    """Outputs (N, 12) whose roll angle and heading have no jumps of 2 pi; their derivatives do not change."""
    turning = jnp.array([6, 8])
    angles = jax.lax.stop_gradient(outputs[:, turning])
    jumps = jnp.unwrap(angles, axis=0) - angles
    return outputs + jnp.zeros_like(outputs).at[:, turning].set(jumps)
