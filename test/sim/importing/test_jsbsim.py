"""JSBSim's models read in. Truth: JSBSim's own forces, numbers of its files, and the exporter's input."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from aircraft_loads import coefficients

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.sim.export.jsbsim import export_jsbsim

pytest.importorskip("jsbsim", reason="JSBSim is not installed")

from sysid_node.sim.importing.jsbsim.files import copy_model, find_model, sections
from sysid_node.sim.importing.jsbsim.program import Flight, Program
from sysid_node.sim.importing.jsbsim.read import read_jsbsim
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS, properties_at
from sysid_node.sim.importing.jsbsim.survey import survey_model


@pytest.mark.slow
def test_derivatives_are_those_found_by_finite_differences(cessna):
    """At 52 m/s, found before by differences of JSBSim's own coefficient properties."""
    known = {"CL_alpha": 5.33, "Cm_alpha": -1.95, "Cm_q": -12.5, "Cm_de": -1.36, "Cn_beta": 0.060, "Cl_p": -0.488}
    found = cessna.imported.aircraft.derivatives
    for name, value in known.items():
        assert found[name].value == pytest.approx(value, rel=0.015), name


def test_masses_and_sizes_are_the_programs(cessna):
    aircraft = cessna.imported.aircraft
    program = Program(cessna.files)
    program.put(cessna.steady.state, {})
    assert aircraft.mass == pytest.approx(program.fdm["inertia/weight-lbs"] * 0.45359237, rel=1e-6)
    assert pytest.approx(program.fdm["metrics/Sw-sqft"] * 0.09290304) == aircraft.geometry.S
    assert aircraft.geometry.b == pytest.approx(program.fdm["metrics/bw-ft"] * 0.3048)
    assert aircraft.inertia.Ixz == pytest.approx(-program.fdm["inertia/ixz-slugs_ft2"] * 1.3558179483)
    eye = [program.fdm[f"metrics/eyepoint-{a}-in"] - program.fdm[f"inertia/cg-{a}-in"] for a in "xyz"]
    assert aircraft.sensors.imu == pytest.approx(np.array(eye) * [-0.0254, 0.0254, -0.0254])


def test_loads_are_the_programs_in_states_of_flight(cessna, tmp_path):
    """Force and moment in 60 random states about the level flight: within 1 % of each one's range, alpha-dot's too."""
    aircraft, steady = cessna.imported.aircraft, cessna.steady
    moved = {name for surface in cessna.surfaces for name in surface.properties}
    program = Program(copy_model(cessna.files, tmp_path, moved))
    random, g, unsteady = np.random.default_rng(3), aircraft.geometry, aircraft.effects["unsteady_aerodynamics"]
    rows, found = [], []
    for _ in range(60):
        speed = steady.state.airspeed * random.uniform(0.85, 1.15)
        alpha, beta = steady.state.alpha + random.uniform(-0.06, 0.1), random.uniform(-0.1, 0.1)
        rates = random.uniform(-1.0, 1.0, 3) * (0.4, 0.2, 0.2)
        deflections = {s.name: steady.deflections[s.name] + random.uniform(-0.1, 0.1) for s in cessna.surfaces}
        driven = {k: v for s in cessna.surfaces for k, v in s.at(deflections[s.name]).items()}
        state = replace(steady.state, airspeed=speed, alpha=alpha, beta=beta, rates=tuple(rates))
        program.put(state, driven)
        load = program.loads()
        thrust = aircraft.throttle.max_thrust * steady.state.throttle
        total = load.air + load.engine - [thrust, 0.0, 0.0, 0.0, thrust * aircraft.throttle.arm, 0.0]
        X, Y, Z, L, M, N = total / (0.5 * load.density * speed**2 * g.S)
        cos, sin, half = np.cos(alpha), np.sin(alpha), 0.5 / speed
        rate = load.alpha_rate * g.cbar * half
        lift = X * sin - Z * cos - unsteady["CL_alphadot"].value * rate
        pitch = M / g.cbar - unsteady["Cm_alphadot"].value * rate
        found.append([lift, -X * cos - Z * sin, Y, L / g.b, pitch, N / g.b])
        p, q, r = rates * half * np.array([g.b, g.cbar, g.b])
        rows.append([alpha, beta, p, q, r, speed, *(deflections[n] for n in ("elevator", "aileron", "rudder"))])
    x = dict(zip(("alpha", "beta", "p", "q", "r", "V", "de", "da", "dr"), np.array(rows).T, strict=True))
    x["throttle"] = np.full(len(rows), steady.state.throttle)
    share = np.abs(coefficients(aircraft, x) - found).max(axis=0) / np.ptp(found, axis=0)
    assert (share < 0.01).all(), share


SERVO = """<actuator name="{0} Servo"><input>fcs/{0}-cmd-norm</input><lag>20</lag><rate_limit>{1}</rate_limit>
<delay>0.05</delay><hysteresis_width>{2}</hysteresis_width><bias>{3}</bias></actuator>
<pure_gain name="{0} Scale"><input>fcs/{0}-servo</input><gain>0.4</gain><output>{4}</output></pure_gain>"""


@pytest.mark.slow
def test_servos_are_read_out_of_the_flight_control_system(tmp_path):
    """c172p with an elevator servo: lag 20 1/s, 3 /s, 0.05 s, play 0.05 and offset 0.01 of a command of 0.4 rad."""
    files = find_model("c172p")
    text = files.main.read_text()
    start, end = text.index('<channel name="Pitch"'), text.index("</channel>", text.index('<channel name="Pitch"'))
    servo = SERVO.format("elevator", 3.0, 0.05, 0.01, "fcs/elevator-pos-rad")
    folder = tmp_path / "own"
    copy = copy_model(files, folder, ())
    copy.main.write_text(text[:start] + f'<channel name="Pitch">{servo}' + text[end:])
    effects = read_jsbsim(str(copy.main), 52.0).aircraft.effects
    assert effects["actuator_lag"]["elevator"].value == pytest.approx(0.05)
    assert effects["actuator_rate_limit"]["elevator"].value == pytest.approx(1.2)
    assert effects["command_delay"]["elevator"].value == pytest.approx(0.05)
    assert effects["actuator_backlash"]["elevator"].value == pytest.approx(0.02)
    assert effects["actuator_bias"]["elevator"].value == pytest.approx(0.004)
    assert "aileron" not in effects["actuator_lag"]


ELEVON = """<summer name="fcs/{0}-elevon-pos-rad"><input>fcs/elevator-position-rad</input>
<input>{1}fcs/aileron-position-rad</input></summer>"""
READ = "<property>fcs/{}-pos-rad</property>"
MIXED = (
    "<product><value>0.5</value><{0}>" + READ.format("right-elevon") + READ.format("left-elevon") + "</{0}></product>"
)


def test_elevons_are_moved_by_two_controls(tmp_path):
    """kestrel's aerodynamics read from elevons what its elevator and aileron were: its derivatives and servos remain.

    Each elevon is moved by both commands; half their sum is the elevator, half their difference the aileron.
    """
    kestrel = load_aircraft("kestrel")
    lags = dict.fromkeys(kestrel.controls, 0.03) | {"aileron": 0.05}
    head, air = export_jsbsim(kestrel, {"actuator_lag": lags}).text.split("<aerodynamics", 1)
    mixer, thrust = ELEVON.format("left", "-") + ELEVON.format("right", ""), '<pure_gain name="fcs/thrust-lbs">'
    for name, kind in (("elevator", "sum"), ("aileron", "difference")):
        air = air.replace(f"<property>fcs/{name}-position-rad</property>", MIXED.format(kind))
    assert thrust in head
    (tmp_path / "kestrel.xml").write_text(head.replace(thrust, mixer + thrust) + "<aerodynamics" + air)
    found = read_jsbsim(str(tmp_path / "kestrel.xml"), 16.0).aircraft
    for name, known in kestrel.derivatives.items():
        assert found.derivatives[name].value == pytest.approx(known.value, abs=1e-6), name
    assert {n: lag.value for n, lag in found.effects["actuator_lag"].items()} == pytest.approx(lags)


def test_two_commands_move_a_tail_as_in_the_program():
    """JSBSim's f16 has a tail that elevator and aileron move: both at once as its own flight control system has it."""
    survey = survey_model("f16", 150.0)
    program = Program(survey.files, 100.0)
    shared = set(survey.surfaces[0].properties) & set(survey.surfaces[1].properties)
    assert shared
    state = Flight(150.0, 0.03, theta=0.03, throttle=0.5)
    shares = {"elevator": 0.5, "aileron": 0.5, "rudder": 0.5}
    program.put(state, {COMMANDS[name]: share for name, share in shares.items()})
    program.step(300)
    deflections = {}
    for s in survey.surfaces:
        order = np.argsort(s.command)
        deflections[s.name] = float(np.interp(shares[s.name], s.command[order], s.deflection[order]))
    ours = properties_at(survey.surfaces, deflections)
    for name in sorted(shared):
        assert ours[name] == pytest.approx(float(program.fdm[name]), abs=1e-3), name


@pytest.mark.slow
def test_a_jet_and_its_yaw_damper(recwarn):
    found = read_jsbsim("737")
    assert found.aircraft.derivatives["Cm_de"].value == pytest.approx(-1.056, abs=0.001)
    assert any(note.startswith("The rudder's position depends on") for note in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "airspeed", "said"),
    [
        ("nobody", None, "JSBSim has no aircraft 'nobody'"),
        ("../c172p", None, "JSBSim has no aircraft"),
        ("none/here.xml", None, "not found"),
        ("ball", None, "must be an aeroplane"),
        ("c172p", 5.0, "no steady level flight at 5 m/s"),
        ("c310", None, "no steady level flight at 60, 73, 93 or 119 m/s"),
        (str(__file__), None, "test_jsbsim.py: JSBSim's models are .xml files; give one, or another --format"),
        ("dr1", None, "does not exist"),
    ],
)
def test_what_cannot_be_read_is_one_line(model, airspeed, said):
    with pytest.raises(InputError, match=said) as error:
        read_jsbsim(model, airspeed)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("airspeed", [None, 52.0])
@pytest.mark.parametrize(
    ("was", "is_now", "said"),
    [
        (
            '<wingarea unit="FT2"> 174 <',
            '<wingarea unit="FT2"> 0 <',
            r"c172p.xml: wing area is 0 m\^2; it must be",
        ),
        ('<wingarea unit="FT2"> 174 <', '<wingarea unit="FT2"> -9 <', r"wing area is -0.836\d* m\^2; it must be above"),
        ('<emptywt unit="LBS"> 1500 <', '<emptywt unit="LBS"> -9000 <', r"mass is -\d.* kg; it must be above zero"),
        ('<wingspan unit="FT"> 35.8 <', '<wingspan unit="FT"> 0 <', "span is 0 m; it must be above zero"),
    ],
)
def test_a_model_without_mass_or_size_is_one_line(tmp_path, airspeed, was, is_now, said):
    text = find_model("c172p").main.read_text()
    assert was in text
    (tmp_path / "c172p.xml").write_text(text.replace(was, is_now))
    with pytest.raises(InputError, match=said):
        read_jsbsim(str(tmp_path / "c172p.xml"), airspeed)


@pytest.mark.slow
def test_a_property_that_is_not_there_is_one_line_and_no_abort(tmp_path):
    """JSBSim throws when it runs, and again when the model is destroyed, at the end of the process."""
    text = find_model("c172p").main.read_text()
    (tmp_path / "c172p.xml").write_text(text.replace("<property>velocities/p-aero-rad_sec", "<property>velocities/xx"))
    words = ["import", str(tmp_path / "c172p.xml"), "--format", "jsbsim", "--out", str(tmp_path / "o.yaml")]
    program = f"import sys; from sysid_node.cli.main import main; sys.exit(main({words}))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert "velocities/xx does not exist" in done.stderr


def test_aerodynamics_are_found_in_the_model():
    assert [s.tag for s in sections(find_model("c172p"))].count("aerodynamics") == 1
    assert Flight(20.0).altitude == 1000.0
