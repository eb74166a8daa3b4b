"""Station ``sensors``: the readings of the instruments, and the motion behind them."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.dynamics.airflow import flow_angles
from sysid_node.dynamics.lever_arm import velocity_at
from sysid_node.dynamics.rigid_body import MassProperties
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.effects import (
    air_data_lag,
    airspeed_scale,
    imu_bias,
    imu_lever_arm,
    imu_misalignment,
    imu_scale,
    sensor_noise,
    vane_bias,
    vane_lever_arm,
    vane_scale,
)
from sysid_node.sim.model.layout import AircraftNumbers, Scalar, Values
from sysid_node.sim.signals.time_shift import slope


def imu_arm(model: AircraftNumbers, effects: dict[str, Values], body: MassProperties) -> Vector:
    """From the CG to the IMU, m."""
    return Vector(*model.imu).plus(imu_lever_arm.arm(effects["imu_lever_arm"])).minus(body.cg)


def air_data_arm(model: AircraftNumbers, effects: dict[str, Values], body: MassProperties) -> Vector:
    """From the CG to the air-data probe, m."""
    return Vector(*model.air_data).plus(vane_lever_arm.arm(effects["vane_lever_arm"])).minus(body.cg)


def accelerometers(effects: dict[str, Values], specific_force: Vector) -> Vector:
    """Readings (m/s^2) of a specific force at the IMU."""
    turned = imu_misalignment.apply(effects["imu_misalignment"], specific_force)
    return imu_bias.accelerometers(effects["imu_bias"], imu_scale.accelerometers(effects["imu_scale"], turned))


def gyroscopes(effects: dict[str, Values], rates: Vector) -> Vector:
    """Readings (rad/s) of angular rates."""
    turned = imu_misalignment.apply(effects["imu_misalignment"], rates)
    return imu_bias.gyroscopes(effects["imu_bias"], imu_scale.gyroscopes(effects["imu_scale"], turned))


def turned_by(effects: dict[str, Values], acceleration: Vector) -> Vector:
    """Rate of change of the gyroscopes' readings (rad/s^2) at an angular acceleration of the body (rad/s^2)."""
    turned = imu_misalignment.apply(effects["imu_misalignment"], acceleration)
    return imu_scale.gyroscopes(effects["imu_scale"], turned)


def rates_from(effects: dict[str, Values], reading: Vector) -> Vector:
    """The body's rates (rad/s) behind the gyroscopes' readings."""
    scaled = imu_scale.true_rates(effects["imu_scale"], imu_bias.true_rates(effects["imu_bias"], reading))
    return imu_misalignment.undo(effects["imu_misalignment"], scaled)


def at_probe(velocity: Vector, rates: Vector, arm: Vector) -> tuple[Scalar, Scalar, Scalar]:
    """Airspeed (m/s), alpha, beta (rad) at the air-data probe."""
    return flow_angles(velocity_at(velocity, rates, arm), jnp)


def lagged(effects: dict[str, Values], state: Scalar, truth0: Scalar, truth1: Scalar, step: Scalar) -> Scalar:
    """The lagged flow (3,) at the probe one sample (``step`` s) later, before its calibration errors."""
    return air_data_lag.advance(effects["air_data_lag"], state, truth0, truth1, step)


def air_data(
    effects: dict[str, Values], airspeed: Scalar, alpha: Scalar, beta: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Readings of airspeed (m/s), alpha and beta (rad)."""
    vanes = vane_bias.apply(effects["vane_bias"], *vane_scale.apply(effects["vane_scale"], alpha, beta))
    return airspeed_scale.apply(effects["airspeed_scale"], airspeed), *vanes


def flow_from(
    effects: dict[str, Values], airspeed: Scalar, alpha: Scalar, beta: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """The lagged flow (m/s, rad) at the probe, from its readings."""
    angles = vane_scale.undo(effects["vane_scale"], *vane_bias.undo(effects["vane_bias"], alpha, beta))
    return airspeed_scale.undo(effects["airspeed_scale"], airspeed), *angles


def before_lag(effects: dict[str, Values], reading: Scalar, flow_rate: Scalar | None, step: Scalar) -> Scalar:
    """The flow (N, 3) before the probe's lag, from the lagged flow and the rate of the true flow (N, 3).

    The rate follows from the inertial instruments. Where it is None, differences of the readings replace it, which
    amplify the noise.
    """
    if flow_rate is None:
        return air_data_lag.undo(effects["air_data_lag"], reading, slope(reading, step))
    return reading + air_data_lag.behind(effects["air_data_lag"], flow_rate, step)


def noisy(model: AircraftNumbers, effects: dict[str, Values], reading: Scalar, realisation: Scalar) -> Scalar:
    """Readings (12,) with noise."""
    return sensor_noise.apply(effects["sensor_noise"], reading, model.noise, realisation)
