"""Exported JSBSim models: JSBSim flies them as our simulator does."""

from dataclasses import replace

import numpy as np
import pytest
from plain import make_aircraft, steps

from sysid_node.aircraft.model import LookupTable
from sysid_node.errors import InputError
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.export.jsbsim import export_jsbsim, jsbsim_model

RATE, SECONDS, SUBSTEPS = 400.0, 10.0, 8

#: Effects that both programs have; those that are flown together act at other places.
CASES = {
    "lag and masses": {"actuator_lag": {"elevator": 0.12, "aileron": 0.04, "rudder": 0.08},
                       "mass_error": {"error": 0.1}, "inertia_error": {"Ixx": 0.2, "Iyy": -0.1, "Ixz": 0.02}},
    "second order and thrust": {"actuator_lag": {"elevator": 0.06, "aileron": 0.04, "rudder": 0.05, "damping": 0.6},
                                "thrust_scale": {"error": 0.2}, "thrust_line_offset": {"arm": 0.03},
                                "motor_lag": {"time_constant": 0.3},
                                "thrust_yaw": {"arm": 0.02, "p_factor": 0.1, "torque_arm": 0.01}},
    "rate limit and CG shift": {"actuator_rate_limit": {"rate": 0.35}, "cg_shift": {"x": 0.02, "y": 0.004, "z": 0.01}},
    "delay and propwash": {"command_delay": {"delay": 0.07}, "propwash": {"gain": 3.0},
                           "control_nonlinearity": {"elevator": 10.0, "rudder": 10.0}},
    "offset and curved": {"actuator_bias": {"elevator": 0.02, "rudder": -0.01},
                          "nonlinear_pitching_moment": {"quadratic": 2.0, "cubic": -10.0},
                          "drag_rise": {"parabola": 0.2},
                          "lateral_alpha_coupling": {"Cl_beta_alpha": -1.0, "Cl_r_alpha": 2.0, "Cn_beta_alpha": 0.5},
                          "lateral_asymmetry": {"CY_0": 0.003, "Cl_0": 0.0005, "Cn_0": 0.0005}},
    "failures and unsteady": {"control_effectiveness_loss": {"aileron": 0.3, "onset": -10.0},
                              "stuck_surface": {"rudder": 0.5, "rudder_position": 0.02, "onset": -10.0},
                              "unsteady_aerodynamics": {"CL_alphadot": 3.0, "Cm_alphadot": -4.0}},
    "stall and derivatives": {"stall_separation": {"depth": 1.0, "alpha_star": 0.2},
                              "derivative_error": {"Cm_alpha": -0.1, "Cn_beta": 0.01}},
    "tables": {},
    "tables over rates": {"command_delay": {"throttle": 0.1}, "motor_lag": {"time_constant": 0.2}},
}  # fmt: skip

OVER_RATES = (
    LookupTable("Cl", ("p",), ((-0.2, 0.0, 0.2),), (0.01, 0.0, -0.02)),
    LookupTable("Cm", ("q",), ((-0.02, 0.0, 0.02),), (0.01, 0.0, -0.02)),
    LookupTable("Cn", ("r", "beta"), ((-0.2, 0.2), (-0.2, 0.2)), ((0.001, 0.002), (-0.001, -0.003))),
    LookupTable("CD", ("throttle",), ((0.0, 0.1, 1.0),), (0.02, 0.01, -0.1)),
)

TABLES = (
    LookupTable("CL", ("alpha",), ((-0.2, 0.05, 0.08, 0.4),), (-0.05, 0.0, 0.02, -0.1)),
    LookupTable("Cm", ("alpha", "de"), ((0.0, 0.1), (-0.2, 0.0, 0.2)), ((0.01, 0.0, 0.01), (-0.01, -0.02, 0.02))),
    LookupTable("CD", ("V",), ((10.0, 18.0, 25.0),), (0.01, 0.0, 0.02)),
    LookupTable("CD", ("throttle",), ((0.0, 0.1, 1.0),), (0.02, 0.01, -0.1)),
)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_jsbsim_flies_as_we_do(tmp_path, case):
    """10 s of 3-2-1-1 from trim: rates and flow angles within 0.5 % of their range."""
    jsbsim_flight = pytest.importorskip("jsbsim_flight", reason="JSBSim is not installed")
    tables = {"tables": TABLES, "tables over rates": OVER_RATES}
    simulator = Simulator(replace(make_aircraft(), tables=tables.get(case, ())), RATE)
    theta = simulator.vector(CASES[case])
    trim = trim_flight(simulator, theta=theta)
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    moves = [steps(time, 1.0, 0.05), steps(time, 4.0, 0.04), steps(time, 6.5, 0.06), 3.0 * (np.abs(time - 5.0) < 1.0)]
    commands = trim.command + np.column_stack(moves)
    states = np.asarray(simulator.rollout(theta, trim.initial, simulator.inputs(commands)).states)
    u, v, w = states[:, 3:6].T
    ours = np.column_stack([states[:, 10:13], np.arctan2(w, u), np.arctan2(v, np.hypot(u, w))])
    model = jsbsim_model(simulator.aircraft, simulator.effects(CASES[case]))
    theirs = jsbsim_flight.fly(model, "test", tmp_path, RATE, trim.initial, commands, 30.0, SUBSTEPS)
    share = np.abs(ours - theirs).max(axis=0) / np.ptp(ours, axis=0)
    assert (share < 0.005).all(), share


def test_free_play_is_a_play_operator(tmp_path):
    """A slow sine of the rudder with 0.03 rad of play: x follows u - 0.015 upwards and u + 0.015 downwards."""
    jsbsim_flight = pytest.importorskip("jsbsim_flight", reason="JSBSim is not installed")
    model = jsbsim_model(make_aircraft(), {"actuator_backlash": {"rudder": 0.03}, "actuator_bias": {"rudder": 0.01}})
    fdm = jsbsim_flight.load(model, "test", tmp_path, RATE, 100.0)
    jsbsim_flight.start(fdm, trim_flight(Simulator(make_aircraft())).initial, np.zeros(4), 30.0)
    fdm.suspend_integration()
    commands = 0.1 * np.sin(2.0 * np.pi * np.arange(800) / 400.0)
    x, rows, expected = 0.0, [], []
    for u in commands:
        fdm["fcs/rudder-cmd-rad"] = float(u)
        fdm.run()
        rows.append(fdm["fcs/rudder-position-rad"])
        x = max(x, u - 0.015) if u > x else min(x, u + 0.015)
        expected.append(x + 0.01)
    assert rows == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("effects", "line"),
    [
        ({"ground_effect": {"lift": 0.2}}, "ground_effect: the model's aerodynamics have none"),
        ({"structural_mode": {"gain": 0.2}}, "structural_mode: the model is rigid"),
        ({"vane_bias": {"alpha": 0.02}}, "vane_bias: it lies in the flight's instruments, not in the simulator"),
        (
            {"control_effectiveness_loss": {"rudder": 0.3, "onset": 12.0}},
            "control_effectiveness_loss: it begins in the course of the flight",
        ),
    ],
)
def test_what_jsbsim_does_not_hold_is_a_line(effects, line):
    assert export_jsbsim(make_aircraft(), effects).left_out == (line,)


def test_jsbsim_refuses_effects_that_it_does_not_know():
    with pytest.raises(InputError, match=r"'ground_effect' cannot be exported to jsbsim; those that can: actuator_lag"):
        jsbsim_model(make_aircraft(), {"ground_effect": {"lift": 0.2}})
