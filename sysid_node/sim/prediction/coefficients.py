"""The six aerodynamic coefficients that accelerations show, predicted or measured.

Klein & Morelli (2006), "Aircraft System Identification", ch. 5.
"""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.dynamics.airflow import flow_angles, stability_axes, velocity_of
from sysid_node.dynamics.atmosphere import dynamic_pressure
from sysid_node.dynamics.coefficients import Coefficients
from sysid_node.dynamics.forces import coefficients_of, thrust_axes
from sysid_node.dynamics.lever_arm import specific_force_from, velocity_from
from sysid_node.dynamics.rigid_body import moment_for
from sysid_node.dynamics.vector import Vector
from sysid_node.sim.model.layout import AircraftNumbers
from sysid_node.sim.prediction.accelerations import Accelerations
from sysid_node.sim.prediction.signals import MeasuredSignals
from sysid_node.sim.stations import mass, propulsion

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
