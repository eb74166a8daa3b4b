"""Loads that corrections add to JSBSim's c172p. Truth: the equations of the effects, written here anew."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from corrected_model import FOOT, POUND, added_load, having, loads_of, moved_by_hand, put_twice, running

from sysid_node.sim.correcting.jsbsim_model import write_corrected
from sysid_node.sim.model.layout import reference_flight

#: Deflections from the steady flight's, rad.
MOVED = {"elevator": -0.08, "aileron": 0.05, "rudder": 0.1}


class Flown:
    """A corrected model in one state: what was added, and what JSBSim says of the state."""

    def __init__(self, survey, file, effects, folder):
        corrected = write_corrected(survey, file, having(file, **effects), folder / "corrected")
        assert not corrected.left_out
        program = running(corrected.files, folder / "run", without=moved_by_hand(survey))
        self.state = replace(survey.steady.state, alpha=0.09, beta=0.05, rates=(0.1, 0.08, -0.06))
        self.deflection = {name: survey.steady.deflections[name] + x for name, x in MOVED.items()}
        put_twice(program, survey, self.state, self.deflection)
        self.added, density = added_load(program)
        self.pressure = 0.5 * density * self.state.airspeed**2 * file.geometry.S
        fdm = program.fdm
        self.thrust = fdm["forces/fbx-prop-lbs"] * POUND
        self.propulsion = np.array([*(fdm[f"forces/fb{a}-prop-lbs"] * POUND for a in "xyz"),
                                    *(fdm[f"moments/{a}-prop-lbsft"] * POUND * FOOT for a in "lmn")])  # fmt: skip
        self.lift = fdm["forces/fwz-aero-lbs"] * POUND / self.pressure
        self.alpha_rate = fdm["aero/alphadot-rad_sec"] * file.geometry.cbar / (2.0 * self.state.airspeed)
        self.level, alpha = reference_flight(file)
        self.late = self.state.alpha - alpha


def assert_adds(survey, file, effects, folder, expected):
    """``expected`` gives coefficients by name, or a load (6,), of a state."""
    flown = Flown(survey, file, effects, folder)
    wanted = expected(flown)
    if isinstance(wanted, dict):
        wanted = loads_of(wanted, flown.state.alpha, flown.pressure, file.geometry)
    assert np.abs(wanted).max() > 1.0  # N or N m: the effect does something
    assert flown.added == pytest.approx(wanted, abs=1e-6 * flown.pressure)


def load(**entries):
    return np.array([entries.get(name, 0.0) for name in ("X", "Y", "Z", "L", "M", "N")])


THRUST = {
    "thrust_scale": ({"error": 0.2}, lambda f: 0.2 * f.propulsion),
    "thrust_line_offset": ({"arm": 0.05}, lambda f: load(M=0.05 * f.thrust)),
    "thrust_yaw": (
        {"arm": 0.02, "p_factor": 0.3, "torque_arm": -0.01},
        lambda f: load(L=-0.01 * f.thrust, N=(0.02 + 0.3 * f.state.alpha) * f.thrust),
    ),
    "propwash": (
        {"gain": 3.0},
        lambda f: {
            "CL": 0.3 * 3.0 * f.thrust / f.pressure * f.deflection["elevator"],
            "Cm": 0.3 * 3.0 * f.thrust / f.pressure * f.deflection["elevator"],
            "Cn": 0.3 * 3.0 * f.thrust / f.pressure * f.deflection["rudder"],
        },
    ),
}


@pytest.mark.parametrize("effect", THRUST)
def test_thrust(survey, file, tmp_path, effect):
    """Shares of JSBSim's own thrust, along the body's x axis; derivatives of the file are 0.3."""
    values, expected = THRUST[effect]
    assert_adds(survey, file, {effect: values}, tmp_path, expected)


AERODYNAMICS = {
    "nonlinear_pitching_moment": (
        {"quadratic": 2.0, "cubic": -10.0},
        lambda f: {"Cm": 2.0 * f.late**2 - 10.0 * f.late**3},
    ),
    "drag_rise": ({"parabola": 0.4}, lambda f: {"CD": 0.4 * (f.lift - f.level) ** 2}),
    "control_nonlinearity": (
        {"elevator": 20.0, "aileron": 30.0, "rudder": 10.0},
        lambda f: {
            "CL": -0.3 * 20.0 * f.deflection["elevator"] ** 3,
            "Cm": -0.3 * 20.0 * f.deflection["elevator"] ** 3,
            "Cl": -0.3 * 30.0 * f.deflection["aileron"] ** 3,
            "Cn": -0.3 * 10.0 * f.deflection["rudder"] ** 3,
        },
    ),
    "unsteady_aerodynamics": (
        {"CL_alphadot": 2.0, "Cm_alphadot": -5.0},
        lambda f: {"CL": 2.0 * f.alpha_rate, "Cm": -5.0 * f.alpha_rate},
    ),
}


@pytest.mark.parametrize("effect", AERODYNAMICS)
def test_aerodynamics(survey, file, tmp_path, effect):
    """Terms in alpha from level flight, the model's own lift, deflections cubed, and JSBSim's rate of alpha."""
    values, expected = AERODYNAMICS[effect]
    assert_adds(survey, file, {effect: values}, tmp_path, expected)


def test_a_changed_effect_adds_its_change(survey, file, tmp_path):
    """From 0.05 to 0.15 of an arm that the file has already."""
    known = having(file, thrust_line_offset={"arm": 0.05})
    flown = Flown(survey, known, {"thrust_line_offset": {"arm": 0.15}}, tmp_path)
    assert flown.added == pytest.approx(load(M=0.1 * flown.thrust), abs=1e-6 * flown.pressure)
