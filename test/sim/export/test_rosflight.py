"""ROSflight's parameters. Truth: fixedwing_forces_and_moments.cpp, and the aircraft that was exported."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from aircraft_loads import coefficients
from plain import DERIVATIVES, make_aircraft

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Control, Derivative, Throttle
from sysid_node.errors import InputError
from sysid_node.sim.export.polar import polar_of
from sysid_node.sim.export.rosflight import rosflight_parameters
from sysid_node.sim.importing.rosflight import read_rosflight

SHARED = Path(__file__).resolve().parents[4] / "shared" / "models"


def parameters(exported):
    return yaml.safe_load(exported.text)["/**"]["ros__parameters"]


def read_again(exported, folder, airspeed=16.0):
    path = folder / "model.yaml"
    path.write_text(exported.text)
    return read_rosflight(path, airspeed).aircraft


def said(exported, beginning):
    found = [line for line in exported.left_out if line.startswith(beginning)]
    assert len(found) == 1, exported.left_out
    return found[0]


def test_derivatives_are_per_rad_with_the_largest_angles():
    """Versions with max_elevator_deflection_angle: the command times this angle; aileron positive to the right."""
    aircraft = make_aircraft()
    values = parameters(rosflight_parameters(aircraft))
    assert all(isinstance(value, float) for value in values.values())
    assert values["C_ell_delta_a"] == pytest.approx(-DERIVATIVES["Cl_da"])
    assert values["C_m_delta_e"] == pytest.approx(DERIVATIVES["Cm_de"])
    assert values["max_elevator_deflection_angle"] == pytest.approx(math.degrees(0.4))
    polar = polar_of(aircraft)
    wing = values["C_L_O"] + values["C_L_alpha"] * polar.alpha
    drag = values["C_D_p"] + wing**2 / (3.14159 * 0.9 * values["wing_b"] ** 2 / values["wing_s"])
    assert drag == pytest.approx(polar.zero + polar.factor * polar.lift**2)


def test_a_drag_of_rosflights_form_is_exact(tmp_path):
    """CD_k of the plugin's own induced drag and no lift but the wing's: all six coefficients over alpha to 1e-6."""
    kestrel = load_aircraft("kestrel")
    ratio = kestrel.geometry.b**2 / kestrel.geometry.S
    wing = {n: d for n, d in kestrel.derivatives.items() if n not in ("CL_de", "CL_q")}
    values = {n: d for n, d in wing.items() if not n.startswith("CD")}
    values |= {"CD_0": Derivative(0.03), "CD_k": Derivative(1.0 / (3.14159 * 0.9 * ratio))}
    aircraft = replace(kestrel, derivatives=values)
    exported = rosflight_parameters(aircraft)
    found = read_again(exported, tmp_path)
    x = dict.fromkeys(("beta", "p", "q", "r", "de", "da", "dr"), np.zeros(19))
    x |= {"alpha": np.deg2rad(np.arange(-3.0, 6.5, 0.5)), "V": np.full(19, 16.0)}
    np.testing.assert_allclose(coefficients(found, x), coefficients(aircraft, x), atol=1e-6)
    assert not exported.left_out
    # lift of the elevator has no induced drag there: its slope in level flight is in C_D_delta_e, and the rest is said
    elevator = replace(aircraft, derivatives=aircraft.derivatives | {"CL_de": kestrel.derivatives["CL_de"]})
    assert "CD by" in said(rosflight_parameters(elevator), "de from")


def test_thrust_is_in_proportion_to_the_throttle(tmp_path):
    """The motor of the text, by its balance of torques solved here: T = 14.4 N throttle at any airspeed."""
    aircraft = replace(load_aircraft("kestrel"), throttle=Throttle("throttle", 16.0))
    effects = {"thrust_scale": {"error": -0.1}, "thrust_yaw": {"torque_arm": -0.02}}
    p = parameters(rosflight_parameters(aircraft, effects))
    rho, D = p["rho"], p["D_prop"]
    for throttle, speed in ((0.1, 5.0), (0.5, 16.0), (1.0, 30.0)):
        a = p["CQ_0"] * rho * D**5 / (2 * math.pi) ** 2
        b = p["CQ_1"] * rho * D**4 * speed / (2 * math.pi) + p["KQ"] ** 2 / p["R_motor"]
        c = p["CQ_2"] * rho * D**3 * speed**2 - p["KQ"] / p["R_motor"] * p["V_max"] * throttle + p["KQ"] * p["I_0"]
        omega = (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
        thrust = rho * D**4 * p["CT_0"] * (omega / (2 * math.pi)) ** 2
        assert thrust == pytest.approx(14.4 * throttle, rel=1e-6)
        assert rho * D**5 * p["CQ_0"] * (omega / (2 * math.pi)) ** 2 == pytest.approx(0.02 * thrust, rel=1e-6)
    assert read_again(rosflight_parameters(aircraft), tmp_path).throttle.max_thrust == pytest.approx(16.0, rel=1e-6)


def test_servo_tau_is_that_of_elevator_and_aileron(tmp_path):
    same = rosflight_parameters(load_aircraft("kestrel"), {"actuator_lag": {"elevator": 0.05, "aileron": 0.05}})
    lags = {n: item.value for n, item in read_again(same, tmp_path).effects["actuator_lag"].items()}
    assert lags == pytest.approx({"elevator": 0.05, "aileron": 0.05})
    assert not [line for line in same.left_out if "lag" in line]
    differ = rosflight_parameters(load_aircraft("kestrel"), {"actuator_lag": {"elevator": 0.05, "rudder": 0.02}})
    assert parameters(differ)["servo_tau"] == pytest.approx(0.025)
    assert "the mean of elevator 0.05 s, aileron 0 s" in said(
        differ, "actuator_lag: servo_tau is one for both, 0.025 s"
    )
    assert said(differ, "actuator_lag of rudder (0.02 s): rosflight_sim moves the rudder without a lag")
    none = rosflight_parameters(load_aircraft("kestrel"))
    assert "actuator_lag" not in read_again(none, tmp_path).effects
    assert parameters(none)["servo_tau"] == pytest.approx(0.0015)  # left out, rosflight_sim would take 0.01 s


@pytest.mark.slow
@pytest.mark.parametrize("name", ["aerosonde", "anaconda"])
def test_what_was_read_from_rosflight_is_found_again(name):
    """Stall (M, alpha0), lift, parasitic drag and derivatives of the file to 1e-6."""
    path = SHARED / f"rosflight_{name}_dynamics.yaml"
    if not path.is_file():
        pytest.skip("the models of other projects are not here (../shared/models)")
    aircraft = read_rosflight(path).aircraft
    exported = rosflight_parameters(aircraft, aircraft.effect_values())
    own = {k: v for node in yaml.safe_load(path.read_text()).values() for k, v in node["ros__parameters"].items()}
    found = parameters(exported)
    held = ["C_L_O", "C_L_alpha", "C_D_p", "C_m_alpha", "C_m_q", "C_m_delta_e", "C_Y_beta", "C_n_beta", "C_ell_p",
            "C_ell_delta_a", "C_n_delta_r", "C_D_delta_e", "servo_tau"]  # fmt: skip
    stalls = name == "aerosonde"  # the other states largest angles, and with them a linear lift
    held += ["wing_M", "wing_alpha0"] if stalls else ["max_elevator_deflection_angle"]
    for key in held:
        assert found[key] == pytest.approx(float(own[key]), rel=1e-6, abs=1e-6), key
    assert bool([line for line in exported.left_out if line.startswith("stall: only versions")]) == stalls
    assert "keep your own motor, propeller and C_ell_O" in said(exported, "V from")


def test_a_shifted_centre_of_gravity_is_in_the_derivatives(tmp_path):
    """Cm about a place 0.02 m ahead: less 0.02 / cbar of CL cos + CD sin, in value and slope at level flight."""
    kestrel = load_aircraft("kestrel")
    exported = rosflight_parameters(kestrel, {"cg_shift": {"x": 0.02}})
    values, d = parameters(exported), {n: x.value for n, x in kestrel.derivatives.items()}
    assert values["C_m_delta_e"] == pytest.approx(d["Cm_de"] - 0.02 / 0.205 * d["CL_de"], abs=2e-3)
    assert values["C_n_beta"] == pytest.approx(d["Cn_beta"] - 0.02 / 1.6 * d["CY_beta"], abs=1e-4)
    assert said(exported, "cg_shift (x 0.02 m)")


@pytest.mark.parametrize(
    ("effect", "line"),
    [
        ({"command_delay": {"elevator": 0.05}}, "command_delay: rosflight_sim has no delay of commands"),
        ({"actuator_rate_limit": {"elevator": 1.0}}, "actuator_rate_limit: rosflight_sim's servos have none"),
        ({"actuator_backlash": {"elevator": 0.02}}, "actuator_backlash: rosflight_sim's servos have no free play"),
        ({"motor_lag": {"time_constant": 0.2}}, "motor_lag: rosflight_sim's motor follows at once"),
        ({"unsteady_aerodynamics": {"CL_alphadot": 2.0}}, "unsteady_aerodynamics: rosflight_sim has no terms"),
        ({"vane_bias": {"alpha": 0.02}}, "vane_bias: it lies in the flight's instruments, not in the simulator"),
        ({"thrust_line_offset": {"arm": 0.02}}, "arm of the thrust (0.02 m): rosflight_sim's thrust lies in"),
        ({"thrust_yaw": {"torque_arm": 0.02}}, "thrust_yaw torque_arm of the thrust (0.02 m): rosflight_sim's thrust"),
        ({"nonlinear_pitching_moment": {"quadratic": 1.0}}, "alpha from"),
        ({"propwash": {"gain": 2.0}}, "throttle from 0 to 1: differs in"),
        ({"stuck_surface": {"rudder": 1.0, "rudder_position": 0.1, "onset": 5.0}}, "stuck_surface: it begins in the"),
    ],
)
def test_what_rosflight_does_not_hold_is_a_line(effect, line):
    said(rosflight_parameters(load_aircraft("kestrel"), effect), line)


def test_a_jammed_rudder_is_an_offset(tmp_path):
    """Jammed at 0.1 rad before the flight: no effect of the command, Cn_0 = Cn_dr 0.1."""
    effects = {"stuck_surface": {"rudder": 1.0, "rudder_position": 0.1, "onset": -10.0}}
    values = parameters(rosflight_parameters(load_aircraft("kestrel"), effects))
    assert values["C_n_delta_r"] == pytest.approx(0.0, abs=1e-9)
    assert values["C_n_O"] == pytest.approx(-0.0946 * 0.1, abs=1e-9)


def test_controls_that_rosflight_does_not_have_are_one_line():
    flap = Control("flap", "df", {"flap": 1.0})
    with pytest.raises(InputError, match="control 'flap': rosflight_sim knows elevator, aileron and rudder only"):
        rosflight_parameters(replace(make_aircraft(), controls={**make_aircraft().controls, "flap": flap}))
