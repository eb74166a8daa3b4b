"""The motion and flow behind the measured signals: the sensors' effects undone."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from sysid_node.dynamics.airflow import flow_angles, velocity_of
from sysid_node.dynamics.lever_arm import velocity_from
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects import turbulence
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.prediction.signals import MeasuredSignals
from sysid_node.sim.signals.time_shift import shift_cubic, slope
from sysid_node.sim.stations import command, sensors
from sysid_node.sim.stations.airflow import Air


class TrueMotion(NamedTuple):
    """Motion, flow and commands without the errors of their sensors and clocks: of one sample, or series of N."""

    command: Scalar  # (controls + 1,) as it reaches the actuators, rad, and thrust in N
    velocity: Vector  # of the CG relative to the air, m/s
    rates: Vector  # rad/s
    density: Scalar  # kg/m^3
    climb: Scalar  # m since the start
    alpha_rate: Scalar  # rad/s
    air_rotation: Vector  # of the air, as far as the aircraft feels it, rad/s
    time: Scalar  # s since the recording began


def true_motion(chain: Chain, signals: MeasuredSignals) -> TrueMotion:
    """The motion (N,) at the times of the samples, from the measured signals."""
    effects, step = chain.effects, chain.step
    late_imu, late_air = effects["imu_delay"]["delay"], effects["air_data_delay"]["delay"]
    rates = sensors.rates_from(effects, Vector(*shift_cubic(signals.rates, -late_imu / step).T))
    velocity = signals.velocity
    if velocity is None:
        reading = jnp.stack(sensors.flow_from(effects, *shift_cubic(signals.air, -late_air / step).T), 1)
        flow = sensors.before_lag(effects, reading, None, step)
        arm = sensors.air_data_arm(chain.model, effects, chain.body)
        velocity = Vector(*velocity_from(velocity_of(flow.T, jnp), rates, arm))
    _, alpha, _ = flow_angles(velocity, jnp)
    return TrueMotion(
        command=command.arrive(chain.layout, effects, signals.commands, step),
        velocity=velocity,
        rates=rates,
        density=signals.density,
        climb=signals.climb,
        alpha_rate=slope(alpha, step) if signals.alpha_rate is None else signals.alpha_rate,
        air_rotation=_air_rotation(chain, signals),
        time=signals.time,
    )


def _air_rotation(chain: Chain, signals: MeasuredSignals) -> Vector:
    """The air's rotation (N,) as far as the aircraft feels it, rad/s; zero where it is not known."""
    if signals.air_rotation is None:
        still = jnp.zeros_like(signals.density)
        return Vector(still, still, still)
    return Vector(*(turbulence.felt_rotation(chain.effects["turbulence"], part) for part in signals.air_rotation))


def flow_at(motion: TrueMotion) -> Air:
    """The flow at the CG; its rates are those of the aircraft relative to the rotating air."""
    speed, alpha, beta = flow_angles(motion.velocity, jnp)
    turning = motion.rates.minus(motion.air_rotation)
    return Air(motion.velocity, turning, speed, alpha, beta, motion.density)
