"""Corrections written into ROSflight's own parameters. Truth: the parameters' own lines, and Beard & McLain, ch. 4."""

from dataclasses import replace

import numpy as np
import pytest
import yaml

from sysid_node.aircraft.model import Derivative, Geometry
from sysid_node.aircraft.model import UncertainValue as Value
from sysid_node.errors import InputError
from sysid_node.sim.correcting.rosflight_model import corrected_parameters
from sysid_node.sim.importing.rosflight import read_rosflight

#: A small aircraft of our own that blends at stall, as rosflight_sim's files are written: with comments and spaces.
TEXT = """\
# Our own aircraft. Mass: 2.0
# Jx: 0.12
/**:
  ros__parameters:
    rho: 1.2
    mass: 2.0     # kg
/fixedwing_forces_and_moments:
  ros__parameters:
    mass: 2.0
    Jyy: 0.09
    Jzz: 0.19
    wing_s: 0.4
    wing_b: 1.6
    wing_c: 0.25
    wing_M: 40.0
    wing_epsilon: 0.9
    wing_alpha0: 0.3
    C_L_O: 0.2
    C_L_alpha: 5.0
    C_L_q: 6.0
    C_L_delta_e : .2
    C_D_p: 0.03
    C_D_delta_e: 0.02
    C_m_O: 0.02
    C_m_alpha: -0.9   # per rad
    C_m_q: -12.0
    C_m_delta_e: -0.6
    C_Y_beta: -0.5
    C_Y_delta_r: 0.2
    C_ell_beta: -0.08
    C_ell_p: -0.5
    C_ell_r: 0.1
    C_ell_delta_a: 0.12
    C_n_beta: 0.07
    C_n_r: -0.1
    C_n_delta_r: -0.06
    D_prop: 0.3
    CT_0: 0.09
    CT_1: -0.06
    CT_2: -0.1
    CQ_0: 0.006
    CQ_1: 0.004
    CQ_2: -0.015
    KQ: 0.012
    V_max: 16.0
    R_motor: 0.05
    I_0: 1.0
    servo_tau: 0.03
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The file, and the aircraft that was read from it."""
    path = tmp_path_factory.mktemp("rosflight") / "own.yaml"
    path.write_text(TEXT)
    return path, read_rosflight(path).aircraft


def having(aircraft, derivatives=None, **effects):
    changed = {name: Derivative(value) for name, value in (derivatives or {}).items()}
    stated = {name: {key: Value(value) for key, value in values.items()} for name, values in effects.items()}
    return replace(aircraft, derivatives={**aircraft.derivatives, **changed}, effects={**aircraft.effects, **stated})


def changes(exported):
    """Lines that differ, by what stands before the colon: the new number."""
    before, after = TEXT.splitlines(), exported.text.splitlines()
    assert len(before) <= len(after)
    new = [line for line in after if line not in before]
    return {line.partition(":")[0].strip(): float(line.partition(":")[2].split("#")[0]) for line in new}


@pytest.mark.slow
def test_nothing_changed_is_the_same_file(model):
    path, aircraft = model
    assert corrected_parameters(path, aircraft).text == TEXT


def test_only_what_changed_is_changed(model):
    """A derivative by its difference, servos by their lag; a comment behind a number stays."""
    path, aircraft = model
    slope = aircraft.derivatives["Cm_alpha"].value
    lag = dict.fromkeys(("elevator", "aileron"), 0.08)
    exported = corrected_parameters(path, having(aircraft, {"Cm_alpha": slope - 0.1}, actuator_lag=lag))
    # level flight stays that of the file only as far as its slope says: the offset is the file's
    assert changes(exported) == pytest.approx({"C_m_alpha": -1.0, "servo_tau": 0.08}, abs=1e-9)
    assert "    C_m_alpha: -1.0   # per rad\n" in exported.text
    assert not exported.left_out


def test_failures_masses_and_thrust(model):
    """30 % of the rudder lost, 10 % more mass wherever it stands, Iyy 1.2 times, thrust 0.9 times."""
    path, aircraft = model
    after = having(aircraft, control_effectiveness_loss={"rudder": 0.3, "onset": -10.0}, mass_error={"error": 0.1},
                   inertia_error={"Iyy": 0.2, "Ixx": 0.5}, thrust_scale={"error": -0.1})  # fmt: skip
    exported = corrected_parameters(path, after)
    parameters = {k: v for node in yaml.safe_load(exported.text).values() for k, v in node["ros__parameters"].items()}
    expected = {"C_Y_delta_r": 0.14, "C_n_delta_r": -0.042, "mass": 2.2, "Jyy": 0.108, "CT_0": 0.081, "CT_1": -0.054}
    assert {name: parameters[name] for name in expected} == pytest.approx(expected)
    assert "# Jx: 0.18\n" in exported.text
    assert exported.text.count("mass: 2.2") == 2


def test_a_shifted_centre_of_gravity_is_in_the_loads(model, tmp_path):
    """Read again, the coefficients about the new place: Cm less 0.02 / 0.25 of the normal force, at level flight."""
    path, aircraft = model
    exported = corrected_parameters(path, having(aircraft, cg_shift={"x": 0.02}))
    (tmp_path / "new.yaml").write_text(exported.text)
    parameters = {k: v for n in yaml.safe_load(exported.text).values() for k, v in n["ros__parameters"].items()}
    alpha = float(aircraft.source.rpartition("alpha ")[2].partition(" ")[0])
    expected = -0.6 - 0.02 / 0.25 * (0.2 * np.cos(alpha) + 0.02 * np.sin(alpha))
    assert parameters["C_m_delta_e"] == pytest.approx(expected, abs=1e-5)
    assert [line for line in exported.left_out if line.startswith("cg_shift (x 0.02 m)")]


def test_what_of_the_correction_is_not_held_is_a_line(model):
    path, aircraft = model
    after = having(aircraft, command_delay={"elevator": 0.05}, imu_bias={"ax": 0.1}, drag_rise={"parabola": 0.2})
    lines = corrected_parameters(path, after).left_out
    assert "command_delay: rosflight_sim has no delay of commands" in lines
    assert "imu_bias: it lies in the flight's instruments, not in the simulator" in lines
    assert [line for line in lines if line.startswith("alpha from") and "CD by" in line]


def test_a_parameter_that_is_not_there_is_put_in(model):
    path, aircraft = model
    exported = corrected_parameters(path, having(aircraft, {"Cn_p": -0.03}))
    assert "    C_n_p: -0.03\n    wing_s: 0.4\n" in exported.text


def test_parameters_of_another_aircraft_are_one_line(model):
    path, aircraft = model
    with pytest.raises(InputError, match=r"its geometry.S is 0.4, the aircraft 'own' has 0.5") as error:
        corrected_parameters(path, replace(aircraft, geometry=Geometry(0.5, 1.6, 0.25)))
    assert "\n" not in str(error.value)


def test_a_servo_that_is_to_have_no_lag_gets_what_rosflight_follows_at_once(tmp_path):
    """A servo_tau of half of rosflight_sim's refresh period is within one step; the exporter writes it, too."""
    path = tmp_path / "own.yaml"
    path.write_text(TEXT)
    own = read_rosflight(path, 16.0).aircraft
    assert own.effects["actuator_lag"]["elevator"].value > 0.01
    none = {"actuator_lag": dict.fromkeys(("elevator", "aileron"), Value(0.0))}
    exported = corrected_parameters(path, replace(own, effects=none))
    assert yaml.safe_load(exported.text)["/fixedwing_forces_and_moments"]["ros__parameters"]["servo_tau"] == 0.0015
