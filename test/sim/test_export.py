"""Exported models: JSBSim flies its model as our simulator does; the others hold their simulators' numbers."""

import math
from dataclasses import replace
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
import yaml
from plain import DERIVATIVES, make_aircraft, steps

from sysid_node.aircraft.model import LookupTable
from sysid_node.errors import InputError
from sysid_node.sim import Simulator, trim_flight
from sysid_node.sim.export.gazebo import gazebo_plugin
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.export.polar import polar_of
from sysid_node.sim.export.rosflight import rosflight_parameters

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


def test_the_parabola_has_the_files_drag_and_slope():
    aircraft = make_aircraft()
    polar, d = polar_of(aircraft), DERIVATIVES
    trim = trim_flight(Simulator(aircraft))
    assert polar.alpha == pytest.approx(trim.alpha, abs=0.01)  # thrust carries a little of the weight
    at_reference = polar.zero + polar.factor * polar.lift**2
    assert at_reference == pytest.approx(d["CD_0"] + d["CD_alpha"] * polar.alpha)
    assert 2.0 * polar.factor * polar.lift * d["CL_alpha"] == pytest.approx(d["CD_alpha"])


def test_gazebo_takes_derivatives_per_degree_and_the_parabola():
    """AdvancedLiftDrag.cc: control angles in degrees, CD = CD0 + CL^2 / (pi AR eff)."""
    aircraft = make_aircraft()
    plugin = fromstring(gazebo_plugin(aircraft)).find("plugin")
    number = lambda tag: float(plugin.find(tag).text)  # noqa: E731
    polar = polar_of(aircraft)
    assert number("Cema") == DERIVATIVES["Cm_alpha"]
    assert number("Cellp") == DERIVATIVES["Cl_p"]
    assert 1.0 / (math.pi * number("AR") * number("eff")) == pytest.approx(polar.factor)
    surfaces = {s.find("name").text: s for s in plugin.findall("control_surface")}
    assert int(number("num_ctrl_surfaces")) == len(surfaces) == 3
    per_degree = float(surfaces["elevator"].find("Cem_ctrl").text)
    assert per_degree == pytest.approx(DERIVATIVES["Cm_de"] * math.pi / 180.0)


def test_rosflight_takes_derivatives_per_full_deflection():
    """fixedwing_forces_and_moments.cpp: delta in -1..1, aileron positive to the right, drag from C_D_p."""
    aircraft = make_aircraft()
    text = rosflight_parameters(aircraft)
    values = yaml.safe_load(text)["/**"]["ros__parameters"]
    assert all(isinstance(value, float) for value in values.values())
    assert values["C_ell_delta_a"] == pytest.approx(-0.4 * DERIVATIVES["Cl_da"])
    assert values["C_m_delta_e"] == pytest.approx(0.4 * DERIVATIVES["Cm_de"])
    polar = polar_of(aircraft)
    wing = values["C_L_O"] + values["C_L_alpha"] * polar.alpha
    drag = values["C_D_p"] + wing**2 / (math.pi * 0.9 * values["wing_b"] ** 2 / values["wing_s"])
    assert drag == pytest.approx(polar.zero + polar.factor * polar.lift**2)


@pytest.mark.parametrize("export", [gazebo_plugin, rosflight_parameters])
def test_formats_of_derivatives_refuse_effects(export):
    with pytest.raises(InputError, match="'actuator_lag' cannot be exported"):
        export(make_aircraft(), {"actuator_lag": {"time_constant": 0.1}})
