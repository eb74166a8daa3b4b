"""Corrections written into a Gazebo model. Truth: the model's own numbers, and the aircraft file read from it."""

from dataclasses import replace
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
from aircraft_loads import coefficients

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Derivative
from sysid_node.aircraft.model import UncertainValue as Value
from sysid_node.errors import InputError
from sysid_node.sim.correcting.gazebo_model import corrected_sdf
from sysid_node.sim.export.gazebo.model import gazebo_model
from sysid_node.sim.importing.gazebo.read import read_gazebo

LAGS = {"actuator_lag": dict.fromkeys(("elevator", "aileron", "rudder"), 0.05), "motor_lag": {"time_constant": 0.2}}


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A model with servos and a motor of ours and something that no reader knows, and the aircraft read from it."""
    text = gazebo_model(load_aircraft("kestrel"), LAGS).text
    text = text.replace("</model>", "<!-- my camera --><sensor name='camera'/></model>").replace(
        "<cp>0 0 0</cp>", "<cp>-0.03 0 0.01</cp>"
    )
    path = tmp_path_factory.mktemp("gazebo") / "own.sdf"
    path.write_text(text)
    return path, read_gazebo(path, 16.0).aircraft


def having(aircraft, derivatives=None, **effects):
    changed = {name: Derivative(value) for name, value in (derivatives or {}).items()}
    stated = {name: {key: Value(value) for key, value in values.items()} for name, values in effects.items()}
    return replace(aircraft, derivatives={**aircraft.derivatives, **changed}, effects={**aircraft.effects, **stated})


def numbers(text):
    """Every number of the document by its path; children of a name by their place."""
    found = {}

    def walk(element, place):
        for i, child in enumerate(element):
            here = f"{place}/{child.tag}{i if child.tag in ('plugin', 'control_surface', 'joint', 'link') else ''}"
            walk(child, here)
            if (child.text or "").strip():
                found[here] = child.text.strip()

    walk(fromstring(text), "")
    return found


def changed(path, exported):
    before, after = numbers(path.read_text()), numbers(exported.text)
    return {key.rpartition("/")[2]: value for key, value in after.items() if before.get(key) != value}


def read_again(exported, folder):
    (folder / "again.sdf").write_text(exported.text)
    return read_gazebo(folder / "again.sdf", 16.0).aircraft


@pytest.mark.slow
def test_nothing_changed_is_the_same_model(model):
    path, aircraft = model
    exported = corrected_sdf(path, aircraft)
    assert not changed(path, exported)
    assert "<!-- my camera -->" in exported.text
    assert not exported.left_out


@pytest.mark.slow
def test_a_derivative_a_servo_and_the_motor(model, tmp_path):
    """Only their numbers change; the joint's damping of 1 over a lag of 0.1 s is a gain of 10."""
    path, aircraft = model
    lags = {name: item.value for name, item in aircraft.effects["actuator_lag"].items()}
    slope = aircraft.derivatives["Cn_r"].value
    after = having(aircraft, {"Cn_r": slope - 0.05}, actuator_lag={**lags, "elevator": 0.1},
                   motor_lag={"time_constant": 0.4}, thrust_scale={"error": -0.1})  # fmt: skip
    exported = corrected_sdf(path, after)
    new = changed(path, exported)
    assert set(new) == {"Cenr", "p_gain", "timeConstantUp", "timeConstantDown", "motorConstant"}
    assert float(new["p_gain"]) == pytest.approx(10.0)
    assert float(new["timeConstantUp"]) == pytest.approx(0.4)
    found = read_again(exported, tmp_path)
    assert found.derivatives["Cn_r"].value == pytest.approx(slope - 0.05, abs=1e-6)
    assert found.throttle.max_thrust == pytest.approx(14.4)
    assert found.effects["actuator_lag"]["elevator"].value == pytest.approx(0.1)


def test_masses_and_the_centre_of_gravity(model, tmp_path):
    """Moments about a place 0.02 m ahead: slopes and level flight of the file's equation, M' = M - shift x F."""
    path, aircraft = model
    after = having(aircraft, mass_error={"error": 0.1}, inertia_error={"Iyy": 0.2}, cg_shift={"x": 0.02, "z": -0.01})
    exported = corrected_sdf(path, after)
    found = read_again(exported, tmp_path)
    assert found.mass == pytest.approx(1.1 * aircraft.mass, rel=1e-6)
    assert found.inertia.Iyy == pytest.approx(1.2 * aircraft.inertia.Iyy, rel=1e-6)
    assert found.inertia.Ixx == pytest.approx(aircraft.inertia.Ixx, rel=1e-6)
    alpha = np.deg2rad([0.0, 2.0, 4.0])
    x = {n: np.zeros(3) for n in ("beta", "p", "q", "r", *aircraft.control_symbols)} | {"alpha": alpha}
    x["V"] = np.full(3, 16.0)
    own = coefficients(aircraft, x)
    CX, CZ = (
        own[:, 0] * np.sin(alpha) - own[:, 1] * np.cos(alpha),
        -own[:, 0] * np.cos(alpha) - own[:, 1] * np.sin(alpha),
    )
    expected = own[:, 4] - (-0.01 * CX - 0.02 * CZ) / 0.205
    assert coefficients(found, x)[:, 4] == pytest.approx(expected, abs=1e-4)


def test_failures_and_offsets_are_numbers(model, tmp_path):
    path, aircraft = model
    after = having(
        aircraft, control_effectiveness_loss={"rudder": 0.3, "onset": -10.0}, actuator_bias={"elevator": 0.02}
    )
    found = read_again(corrected_sdf(path, after), tmp_path)
    assert found.derivatives["Cn_dr"].value == pytest.approx(0.7 * aircraft.derivatives["Cn_dr"].value, rel=1e-4)
    moment = found.derivatives["Cm_0"].value - aircraft.derivatives["Cm_0"].value
    assert moment == pytest.approx(0.02 * aircraft.derivatives["Cm_de"].value, rel=0.02)


def test_what_of_the_correction_is_not_held_is_a_line(model):
    path, aircraft = model
    after = having(aircraft, command_delay={"elevator": 0.05}, vane_bias={"alpha": 0.02},
                   thrust_line_offset={"arm": 0.02}, nonlinear_pitching_moment={"quadratic": 2.0})  # fmt: skip
    lines = corrected_sdf(path, after).left_out
    assert "command_delay: Gazebo's joints and motors have no delay" in lines
    assert "vane_bias: it lies in the flight's instruments, not in the simulator" in lines
    assert "thrust_line_offset: lower the rotor's link by 0.02 m; its place is left as it is" in lines
    assert [line for line in lines if line.startswith("alpha from") and "Cm by" in line]


def test_a_servo_without_a_controller_is_a_line(model, tmp_path):
    path, _ = model
    bare = tmp_path / "bare.sdf"
    bare.write_text(path.read_text().replace("JointPositionController", "MyController"))
    own = read_gazebo(bare, 16.0).aircraft
    lines = corrected_sdf(bare, having(own, actuator_lag={"elevator": 0.1})).left_out
    assert lines == ("actuator_lag: joint elevator has no JointPositionController against a damping",)


@pytest.mark.parametrize(
    ("was", "is_now", "said"),
    [
        ("AdvancedLiftDrag", "LiftDrag", "it needs one plugin AdvancedLiftDrag and no LiftDrag"),
        ('elevator"', 'stabilator"', "names the joint 'elevator', which the model does not have"),
        ("elevator<", "stabilator<", "names the joint 'stabilator', which the model does not have"),
        ("elevator", "stabilator", "has other controls; it must be read from this file"),
    ],
)
def test_another_model_is_one_line(model, tmp_path, was, is_now, said):
    path, aircraft = model
    other = tmp_path / "other.sdf"
    other.write_text(path.read_text().replace(was, is_now))
    with pytest.raises(InputError, match=said) as error:
        corrected_sdf(other, aircraft)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("derivative", [0.0, 3.0])
def test_a_changed_lag_is_read_back_whatever_the_derivative_gain(model, tmp_path, derivative):
    own = tmp_path / "own.sdf"
    own.write_text(model[0].read_text().replace("<d_gain>0<", f"<d_gain>{derivative}<"))
    aircraft = read_gazebo(own, 16.0).aircraft
    lags = {name: item.value for name, item in aircraft.effects["actuator_lag"].items()}
    exported = corrected_sdf(own, having(aircraft, actuator_lag={**lags, "elevator": 0.2}))
    assert float(changed(own, exported)["p_gain"]) == pytest.approx(1.0 / 0.2)  # the joint's damping over the lag
    assert read_again(exported, tmp_path).effects["actuator_lag"]["elevator"].value == pytest.approx(0.2)


def test_a_servo_that_is_to_have_no_lag_keeps_it_and_says_so(model):
    path, aircraft = model
    lags = {name: item.value for name, item in aircraft.effects["actuator_lag"].items()}
    lines = corrected_sdf(path, having(aircraft, actuator_lag={**lags, "elevator": 0.0})).left_out
    assert lines == ("actuator_lag: joint elevator keeps its lag of 0.05 s; a controller against a damping cannot do "
                     "without one",)  # fmt: skip
