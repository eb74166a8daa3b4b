"""The six aerodynamic coefficients that accelerations show, predicted or measured.

Klein & Morelli (2006), "Aircraft System Identification", ch. 5.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.dynamics.airflow import flow_angles, stability_axes, velocity_of
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.dynamics.coefficients import Coefficients
from sysid_node.dynamics.forces import coefficients_of, thrust_axes
from sysid_node.dynamics.lever_arm import specific_force_from, velocity_from
from sysid_node.dynamics.rigid_body import moment_for
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.prediction.accelerations import Accelerations, predict_accelerations
from sysid_node.sim.prediction.signals import MeasuredSignals
from sysid_node.sim.simulator import Simulator
from sysid_node.sim.stations import mass, propulsion

Array = NDArray[np.float64]

#: Names of the coefficients that ``coefficients`` returns, in this order.
COEFFICIENTS = Coefficients._fields


def coefficients(model: AircraftNumbers, signals: MeasuredSignals, accelerations: Accelerations) -> Coefficients:
    """Coefficients (N,) about the file's CG that accelerations (N,) show, reduced by the aircraft file alone."""
    rates, turning = Vector(*signals.rates.T), accelerations.turning
    imu, probe = Vector(*model.imu), Vector(*model.air_data)
    specific_force = specific_force_from(accelerations.force, rates, turning, imu)
    velocity = velocity_from(velocity_of(signals.air.T, jnp), rates, probe)
    speed, _, _ = flow_angles(velocity, jnp)
    thrust = propulsion.commanded(model, signals.commands[:, -1])
    forward, down = thrust_axes(model.thrust_inclination, jnp)
    pull = Vector(thrust * forward, jnp.zeros_like(thrust), thrust * down)
    force = specific_force.times(model.mass).minus(pull)
    moment = moment_for(mass.nominal(model), rates, turning)
    moment = moment._replace(y=moment.y - model.thrust_arm * thrust)
    pressure_area = dynamic_pressure(signals.density, speed) * model.area
    return coefficients_of(force, moment, stability_axes(velocity, jnp), pressure_area, model.span, model.chord)


@partial(jax.jit, static_argnums=0)
def _expected(
    layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, signals: MeasuredSignals, step: Scalar
) -> Coefficients:
    return coefficients(model, signals, predict_accelerations(layout, model, theta, signals, step))


def predict_coefficients(simulator: Simulator, theta: Scalar | Array, signals: MeasuredSignals) -> Array:
    """CL CD CY Cl Cm Cn (N, 6) that parameters (P,) predict for signals (N,), reduced by the aircraft file."""
    return np.stack(_expected(simulator.layout, simulator.model, theta, signals, simulator.step), axis=1)


@partial(jax.jit, static_argnums=0)
def _slopes(
    layout: ParameterLayout, model: AircraftNumbers, theta: Scalar, signals: MeasuredSignals, step: Scalar
) -> Coefficients:
    slopes: Coefficients = jax.jacfwd(lambda t: _expected(layout, model, t, signals, step))(theta)
    return slopes


def coefficient_slopes(simulator: Simulator, theta: Scalar | Array, signals: MeasuredSignals) -> Array:
    """d ``predict_coefficients`` / d theta (N, 6, P), exact (forward mode)."""
    return np.stack(_slopes(simulator.layout, simulator.model, theta, signals, simulator.step), axis=1)
