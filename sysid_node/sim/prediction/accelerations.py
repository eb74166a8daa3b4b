"""The readings of the inertial instruments that the chain predicts from measured signals.

A rollout integrates the motion; here the motion is taken from the instruments, so that turbulence and drift of the
integral do no harm. The same stations compute forces and moments from recorded commands and from measured flow and
rates, and from these the readings of the accelerometers and the rates of change of the gyroscopes' readings. Effects of
sensors are undone on the inputs and applied to the outputs.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from sysid_node.dynamics.lever_arm import specific_force_at
from sysid_node.dynamics.rigid_body import accelerations
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.model.chain import Chain, drive_of, steady_load, unsteady_load
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.model.parameters import Parameters
from sysid_node.sim.prediction.active_effects import effect_acts, evaluate_if
from sysid_node.sim.prediction.carried_states import CarriedStates, carried_states
from sysid_node.sim.prediction.signals import MeasuredSignals
from sysid_node.sim.prediction.structural_response import body_rates, mode_response
from sysid_node.sim.prediction.true_motion import TrueMotion, flow_at, true_motion
from sysid_node.sim.signals.time_shift import shift_cubic
from sysid_node.sim.stations import sensors, structure
from sysid_node.sim.stations.structure import Vibration


class Accelerations(NamedTuple):
    """What the inertial instruments show, N samples.

    Each column is an array of its own: of a table XLA would compute all columns for each entry.
    """

    force: Vector  # (N,) readings of the accelerometers, m/s^2
    turning: Vector  # (N,) rates of change of the gyroscopes' readings, rad/s^2


class _VibratingMotion(NamedTuple):
    """The motion (N,) of the rigid body and of the structural mode."""

    rates: Vector  # of the rigid body, rad/s
    force: Vector  # specific, at the CG, m/s^2
    acceleration: Vector  # angular, rad/s^2
    mode: Scalar  # (N, 2) displacement m and speed m/s


def predict_accelerations(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Parameters,
    signals: MeasuredSignals,
    step: Scalar,
    acting: Scalar | None = None,
) -> Accelerations:
    """The accelerations (N,) that parameters (P,) predict for measured signals sampled every ``step`` s; pure.

    Only states that depend on the past are computed sample by sample; forces and moments of all samples are computed at
    once. ``acting`` (P,) is true for parameters that are not neutral or will be differentiated; effects without any
    such parameter are left out. None evaluates all effects.
    """
    chain = Chain.of(layout, model, theta, step, jnp.zeros(()))
    motion = true_motion(chain, signals)
    acts = partial(effect_acts, layout, acting)
    states = carried_states(chain, motion, acts, signals.unfiltered)
    force, acceleration = _accelerations(chain, states, motion)
    rigid = _VibratingMotion(motion.rates, force, acceleration, jnp.zeros((*force.z.shape, 2)))
    vibrating = evaluate_if(
        acts("structural_mode"), lambda: _vibrating_motion(chain, states, motion, force), lambda: rigid
    )
    readings = _readings(chain, *vibrating)
    late = chain.effects["imu_delay"]["delay"] / step
    delayed: Accelerations = jax.tree.map(lambda series: shift_cubic(series, late), readings)
    return delayed


@jax.jit  # traced once for both passes
def _accelerations(chain: Chain, states: CarriedStates, motion: TrueMotion) -> tuple[Vector, Vector]:
    """Specific force at the CG (m/s^2) and angular acceleration (rad/s^2), each (N,)."""

    def at(states: CarriedStates, motion: TrueMotion) -> tuple[Vector, Vector]:
        air = flow_at(motion)
        drive, _ = drive_of(chain, states.actuators, states.motor, jnp.zeros(6), motion.time)
        load = steady_load(chain, air, drive, states.separation, motion.climb)
        load = unsteady_load(chain, air, load, motion.alpha_rate)
        return accelerations(chain.body, motion.rates, load.force, load.moment)

    found: tuple[Vector, Vector] = jax.vmap(at)(states, motion)
    return found


def _vibrating_motion(chain: Chain, states: CarriedStates, motion: TrueMotion, force: Vector) -> _VibratingMotion:
    """The motion with the structural mode's response to a specific force (N,) at the CG, m/s^2."""
    mode = mode_response(chain, force.z)
    motion = motion._replace(rates=body_rates(chain, mode, motion.rates))
    force, acceleration = _accelerations(chain, states, motion)
    return _VibratingMotion(motion.rates, force, acceleration, mode)


def _readings(chain: Chain, rates: Vector, force: Vector, acceleration: Vector, mode: Scalar) -> Accelerations:
    """What the instruments show of the motion, the vibration included."""
    effects, arm = chain.effects, sensors.imu_arm(chain.model, chain.effects, chain.body)
    mode_acceleration = structure.acceleration(effects, Vibration(mode[:, 0], mode[:, 1], force.z))
    added_force, added_pitch = structure.felt(effects, mode_acceleration, mode_acceleration)
    at_imu = specific_force_at(force, rates, acceleration, arm)
    return Accelerations(
        sensors.accelerometers(effects, at_imu._replace(z=at_imu.z + added_force)),
        sensors.turned_by(effects, acceleration._replace(y=acceleration.y + added_pitch)),
    )
