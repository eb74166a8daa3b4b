"""Every effect of the simulator, one module each.

A module holds an ``Effect`` (name, station, equation, source, parameters) and the functions that apply it, which its
station calls with the values of the parameter vector. ``EFFECTS`` lists them in the order in which the chain applies
them; that is also the order of the vector's entries.
"""

from __future__ import annotations

from sysid_node.sim.effects import (
    actuator_backlash,
    actuator_bias,
    actuator_lag,
    actuator_rate_limit,
    actuator_stamp_delay,
    air_data_delay,
    air_data_lag,
    airspeed_scale,
    cg_shift,
    command_delay,
    control_effectiveness_loss,
    control_nonlinearity,
    derivative_error,
    drag_rise,
    ground_effect,
    gust,
    imu_bias,
    imu_delay,
    imu_lever_arm,
    imu_misalignment,
    imu_scale,
    inertia_error,
    lateral_alpha_coupling,
    lateral_asymmetry,
    mass_error,
    motor_lag,
    nonlinear_pitching_moment,
    propwash,
    sensor_noise,
    stall_separation,
    steady_wind,
    structural_mode,
    stuck_surface,
    thrust_line_offset,
    thrust_scale,
    thrust_yaw,
    turbulence,
    unsteady_aerodynamics,
    vane_bias,
    vane_lever_arm,
    vane_scale,
)
from sysid_node.sim.effects.base import STATIONS, Effect, SimulationParameter

#: In the order in which the chain applies them.
_MODULES = (
    # command
    command_delay,
    # actuator
    actuator_lag,
    actuator_backlash,
    actuator_rate_limit,
    actuator_bias,
    stuck_surface,
    control_effectiveness_loss,
    # airflow
    steady_wind,
    turbulence,
    gust,
    # aerodynamics
    derivative_error,
    nonlinear_pitching_moment,
    stall_separation,
    unsteady_aerodynamics,
    lateral_alpha_coupling,
    control_nonlinearity,
    drag_rise,
    lateral_asymmetry,
    ground_effect,
    # propulsion
    thrust_scale,
    thrust_line_offset,
    thrust_yaw,
    propwash,
    motor_lag,
    # mass
    mass_error,
    inertia_error,
    cg_shift,
    # structure
    structural_mode,
    # sensors
    imu_bias,
    imu_scale,
    imu_misalignment,
    imu_lever_arm,
    airspeed_scale,
    vane_bias,
    vane_scale,
    vane_lever_arm,
    air_data_lag,
    sensor_noise,
    # clock
    imu_delay,
    air_data_delay,
    actuator_stamp_delay,
)

EFFECTS: dict[str, Effect] = {module.EFFECT.name: module.EFFECT for module in _MODULES}

__all__ = ["EFFECTS", "STATIONS", "Effect", "SimulationParameter"]
