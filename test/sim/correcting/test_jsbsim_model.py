"""Corrections written into JSBSim's c172p. Truth: JSBSim's own forces, masses and surface positions."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from corrected_model import added_load, having, running

from sysid_node.aircraft.model import Derivative, ReferenceCondition
from sysid_node.errors import InputError
from sysid_node.sim.correcting.jsbsim_model import write_corrected
from sysid_node.sim.correcting.user_simulator import user_simulator
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS
from sysid_node.sim.importing.jsbsim.survey import survey_model
from sysid_node.sim.model.layout import reference_flight


def test_increments_of_coefficients_are_those_of_the_file(survey, file, tmp_path):
    """Random states: the added loads are those of the difference of the files, to 1e-6 of pressure times area."""
    changes = {
        "CL_alpha": 0.4,
        "CD_0": 0.01,
        "CY_beta": -0.1,
        "Cl_da": 0.02,
        "Cm_q": -3.0,
        "Cm_de": 0.2,
        "Cn_beta": 0.01,
    }
    derivatives = {n: Derivative(d.value + changes.get(n, 0.0)) for n, d in file.derivatives.items()}
    after = having(replace(file, derivatives=derivatives), lateral_asymmetry={"Cl_0": 0.003},
                   lateral_alpha_coupling={"Cl_beta_alpha": 0.5})  # fmt: skip
    corrected = write_corrected(survey, file, after, tmp_path / "corrected")
    assert not corrected.left_out
    moved = {name for s in survey.surfaces for name in s.properties}
    program = running(corrected.files, tmp_path / "run", without=moved)
    random, g = np.random.default_rng(1), file.geometry
    _, level = reference_flight(after)
    for _ in range(5):
        alpha, beta = 0.02 + random.uniform(-0.05, 0.1), random.uniform(-0.1, 0.1)
        p, q, r = random.uniform(-0.3, 0.3, 3)
        state = replace(survey.steady.state, alpha=alpha, beta=beta, rates=(p, q, r))
        deflections = {s.name: survey.steady.deflections[s.name] + random.uniform(-0.1, 0.1) for s in survey.surfaces}
        driven = {k: v for s in survey.surfaces for k, v in s.at(deflections[s.name]).items()}
        program.put(state, driven)
        added, density = added_load(program)
        pressure, half = 0.5 * density * state.airspeed**2 * g.S, 0.5 / state.airspeed
        CL, CD, CY = 0.4 * alpha, 0.01, -0.1 * beta
        Cl = 0.02 * deflections["aileron"] + 0.003 + 0.5 * beta * (alpha - level)
        Cm, Cn = -3.0 * q * g.cbar * half + 0.2 * deflections["elevator"], 0.01 * beta
        expected = pressure * np.array(
            [CL * math.sin(alpha) - CD * math.cos(alpha), CY, -CL * math.cos(alpha) - CD * math.sin(alpha),
             Cl * g.b, Cm * g.cbar, Cn * g.b]
        )  # fmt: skip
        assert added == pytest.approx(expected, abs=1e-6 * pressure)


def test_servos_move_the_surfaces_as_the_file_says(survey, file, tmp_path):
    """A step of the elevator: lag 0.1 s; of the aileron, both sides: 0.5 rad/s; the rudder with 30 % lost, offset."""
    after = having(file, actuator_lag={"elevator": 0.1}, actuator_rate_limit={"aileron": 0.5},
                   control_effectiveness_loss={"rudder": 0.3}, command_delay={"rudder": 0.05})  # fmt: skip
    corrected = write_corrected(survey, file, after, tmp_path / "corrected")
    program = running(corrected.files, tmp_path / "run")
    surfaces = {s.name: s for s in survey.surfaces}
    program.put(survey.steady.state, dict.fromkeys(COMMANDS.values(), 0.0))
    program.step(800)
    program.suspend()
    program.drive({COMMANDS[name]: surfaces[name].command_for(0.1) for name in COMMANDS})
    rows = []
    for _ in range(80):
        program.fdm.run()
        rows.append([s.sign * s.unit * float(program.fdm[s.position]) for s in surfaces.values()]
                    + [float(program.fdm["fcs/right-aileron-pos-rad"])])  # fmt: skip
    elevator, aileron, rudder, right = np.array(rows).T
    time = np.arange(1, 81) / 400.0
    assert elevator == pytest.approx(0.1 * (1.0 - np.exp(-time / 0.1)), abs=2e-3)
    assert aileron == pytest.approx(np.minimum(0.5 * time, 0.1), abs=1e-6)
    assert np.abs(right) == pytest.approx(np.minimum(0.5 * time, np.abs(right[-1])), abs=1e-6)
    assert rudder == pytest.approx(np.where(time > 0.05 - 1e-9, 0.07, 0.0), abs=1e-6)


def test_a_model_with_an_actuator_keeps_one(survey, file, tmp_path):
    """Lag 0.1 s written into a model of 0.03 s; then read: an actuator with 0.1 s, and its own limits."""
    slow = write_corrected(survey, file, having(file, actuator_lag={"elevator": 0.03}), tmp_path / "own")
    own = survey_model(str(slow.files.main), 52.0, 900.0)
    assert own.servos["elevator"].lag == pytest.approx(0.03)
    known = having(file, actuator_lag={"elevator": 0.03})
    slower = write_corrected(own, known, having(known, actuator_lag={"elevator": 0.1}), tmp_path / "slower")
    assert slower.files.main.read_text().count("<actuator") == 1
    assert survey_model(str(slower.files.main), 52.0, 900.0).servos["elevator"].lag == pytest.approx(0.1)


def test_masses_are_those_of_the_effects(survey, file, tmp_path):
    after = having(file, mass_error={"error": 0.15}, cg_shift={"x": 0.05, "y": -0.01, "z": 0.02},
                   inertia_error={"Ixx": 0.2, "Izz": -0.1, "Ixz": 0.05})  # fmt: skip
    corrected = write_corrected(survey, file, after, tmp_path / "corrected")
    program = running(corrected.files, tmp_path / "run")
    program.put(survey.steady.state, {})
    own = survey.inertia
    assert program.mass == pytest.approx(1.15 * survey.mass, rel=1e-8)
    assert program.place(*survey.cg_in) == pytest.approx((-0.05, 0.01, -0.02), abs=1e-9)
    cross = own["Ixz"] + 0.05 * math.sqrt(own["Ixx"] * own["Izz"])
    expected = [1.2 * own["Ixx"], own["Iyy"], 0.9 * own["Izz"], cross]
    assert [program.inertia[n] for n in ("Ixx", "Iyy", "Izz", "Ixz")] == pytest.approx(expected, rel=1e-6)


def test_the_rest_of_the_file_stays_and_what_is_no_models_is_said(survey, file, tmp_path):
    after = having(file, actuator_lag={"elevator": 0.1}, vane_bias={"alpha": 0.02}, structural_mode={"gain": 0.2},
                   imu_delay={"delay": 0.02})  # fmt: skip
    corrected = write_corrected(survey, file, after, tmp_path)
    before, now = (f.main.read_text().split("<fileheader>")[1].splitlines() for f in (survey.files, corrected.files))
    before, now = Counter(before), Counter(now)
    assert not before - now  # the position's line is the actuator's now
    added = "\n".join((now - before).elements())
    for part in ("elevator-pos-rad-commanded</output>", "<actuator", "<input>", "<lag>10.0</lag>", "</actuator>"):
        assert part in added
    assert sum((now - before).values()) == 5
    assert set(corrected.left_out) == {"vane_bias", "structural_mode", "imu_delay"}
    assert "instruments" in corrected.left_out["vane_bias"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("c172p", "expected jsbsim:NAME"),
        ("gazebo:x", "expected jsbsim:NAME"),
        ("jsbsim:nobody", "JSBSim has no aircraft 'nobody'"),
        ("jsbsim:737", "its mass is"),
    ],
)
def test_a_simulator_that_is_not_the_aircrafts_is_one_line(file, text, said):
    known = replace(file, reference=ReferenceCondition(130.0, 0.9)) if text.endswith("737") else file
    with pytest.raises(InputError, match=said) as error:
        user_simulator(text, known)
    assert "\n" not in str(error.value)


def test_a_copy_may_lie_in_the_models_own_folder(survey, file, tmp_path):
    """A model that lies among results: nothing but the model's XML is copied."""
    own = write_corrected(survey, file, file, tmp_path / "own").files.folder
    (own / "results").mkdir()
    (own / "results" / "bag.mcap").write_text("")
    found = replace(survey, files=replace(survey.files, folder=own))
    copied = write_corrected(found, file, having(file, mass_error={"error": 0.1}), own / "results" / "corrected")
    assert {path.suffix for path in copied.files.folder.rglob("*") if path.is_file()} == {".xml"}
    assert not (copied.files.folder / "results").exists()
