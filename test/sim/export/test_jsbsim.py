"""Exported JSBSim models: JSBSim flies them as our simulator does."""

from dataclasses import replace

import numpy as np
import pytest
from plain import make_aircraft, steps

from sysid_node.aircraft.model import LookupTable
from sysid_node.errors import InputError
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.export.jsbsim import jsbsim_model

RATE, SECONDS, SUBSTEPS = 400.0, 10.0, 8

#: Effects, one at a time, that both programs have.
CASES = {
    "file": {},
    "lag": {"actuator_lag": {"elevator": 0.12, "aileron": 0.04, "rudder": 0.08}},
    "rate limit": {"actuator_rate_limit": {"rate": 0.35}},
    "delay": {"command_delay": {"delay": 0.07}},
    "CG shift": {"cg_shift": {"x": 0.02, "y": 0.004, "z": 0.01}},
    "thrust line": {"thrust_line_offset": {"arm": 0.03}},
    "derivatives": {"derivative_error": {"Cm_alpha": -0.1, "Cn_beta": 0.01}},
    "tables": {},
}

TABLES = (
    LookupTable("CL", ("alpha",), ((-0.2, 0.05, 0.08, 0.4),), (-0.05, 0.0, 0.02, -0.1)),
    LookupTable("Cm", ("alpha", "de"), ((0.0, 0.1), (-0.2, 0.0, 0.2)), ((0.01, 0.0, 0.01), (-0.01, -0.02, 0.02))),
    LookupTable("CD", ("V",), ((10.0, 18.0, 25.0),), (0.01, 0.0, 0.02)),
    LookupTable("CD", ("throttle",), ((0.0, 0.1, 1.0),), (0.02, 0.01, -0.1)),
)


@pytest.mark.parametrize("case", CASES)
def test_jsbsim_flies_as_we_do(tmp_path, case):
    """10 s of 3-2-1-1 from trim: rates and flow angles within 0.5 % of their range."""
    jsbsim_flight = pytest.importorskip("jsbsim_flight", reason="JSBSim is not installed")
    simulator = Simulator(replace(make_aircraft(), tables=TABLES if case == "tables" else ()), RATE)
    theta = simulator.vector(CASES[case])
    trim = trim_flight(simulator, theta=theta)
    time = np.arange(round(SECONDS * RATE) + 1) / RATE
    moves = [steps(time, 1.0, 0.05), steps(time, 4.0, 0.04), steps(time, 6.5, 0.06), np.zeros_like(time)]
    commands = trim.command + np.column_stack(moves)
    states = np.asarray(simulator.rollout(theta, trim.initial, simulator.inputs(commands)).states)
    u, v, w = states[:, 3:6].T
    ours = np.column_stack([states[:, 10:13], np.arctan2(w, u), np.arctan2(v, np.hypot(u, w))])
    model = jsbsim_model(simulator.aircraft, simulator.effects(CASES[case]))
    theirs = jsbsim_flight.fly(model, "test", tmp_path, RATE, trim.initial, commands, 30.0, SUBSTEPS)
    share = np.abs(ours - theirs).max(axis=0) / np.ptp(ours, axis=0)
    assert (share < 0.005).all(), share


def test_jsbsim_refuses_effects_that_it_does_not_know():
    with pytest.raises(InputError, match=r"'propwash' cannot be exported to jsbsim; those that can: actuator_lag"):
        jsbsim_model(make_aircraft(), {"propwash": {"gain": 1.0}})
