"""``sysid export``: what it reads, what it keeps, what it says."""

import json
from dataclasses import replace
from xml.etree.ElementTree import fromstring, parse

import pytest
import yaml
from short_bags import short_bag

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import NO_DELAYS, Derivative, UncertainValue
from sysid_node.cli.main import main
from sysid_node.errors import InputError
from sysid_node.sim.export.gazebo.model import gazebo_model
from sysid_node.sim.export.jsbsim import export_jsbsim
from sysid_node.sim.export.rosflight import rosflight_parameters
from sysid_node.sim.importing.gazebo.read import read_gazebo
from sysid_node.sim.importing.rosflight import read_rosflight

SUMMARY = {
    "aircraft": "cdrw",
    "derivatives": {
        "Cm_alpha": {"value": -0.31, "standard_error": 0.004, "valid": True},
        "Cl_p": {"value": 5.0, "standard_error": 9.0, "valid": False},
        "Cn_r": {"value": None, "standard_error": None, "valid": False},
    },
}


@pytest.fixture
def run(tmp_path):
    written = {"command": "replay", "files": ["aircraft.yaml", "summary.json"]}
    (tmp_path / "summary.json").write_text(json.dumps({**SUMMARY, "written": written}))
    (tmp_path / "aircraft.yaml").write_text(dump_aircraft(load_aircraft("cdrw")))
    return tmp_path


def test_the_aircraft_is_the_runs_own_and_not_one_of_its_name(run):
    """The file that the run keeps has 3 kg; the aircraft cdrw that comes with the package has not."""
    (run / "aircraft.yaml").write_text(dump_aircraft(replace(load_aircraft("cdrw"), mass=3.0)))
    assert main(["export", str(run), "--format", "rosflight", "--out", str(run / "model.yaml"), "--quiet"]) == 0
    assert yaml.safe_load((run / "model.yaml").read_text())["/**"]["ros__parameters"]["mass"] == 3.0


@pytest.mark.slow
@pytest.mark.parametrize("method", ["replay", "identify"])
def test_a_run_is_exported_with_the_aircraft_that_it_began_with(tmp_path, method):
    """As found in use: 3 kg stand in the user's file, whose name is that of a bundled aircraft."""
    known = replace(load_aircraft("cdrw"), mass=3.0)
    (tmp_path / "mine.yaml").write_text(dump_aircraft(known))
    words = [method, str(short_bag("cdrw_multistep", 12.0, tmp_path)), "--out", str(tmp_path / "run"), "--quiet"]
    words += ["--aircraft", str(tmp_path / "mine.yaml")]
    words += ["--method", "equation_error"] if method == "identify" else []
    assert main(words) == 0
    assert load_aircraft(tmp_path / "run" / "aircraft.yaml") == known
    out = tmp_path / "model.yaml"
    assert main(["export", str(tmp_path / "run"), "--format", "rosflight", "--out", str(out), "--quiet"]) == 0
    assert yaml.safe_load(out.read_text())["/**"]["ros__parameters"]["mass"] == 3.0


def test_a_run_without_its_aircraft_needs_it_named(run, capsys):
    """An aircraft file beside the summary that the run did not write is another's."""
    (run / "summary.json").write_text(json.dumps(SUMMARY))
    words = ["export", str(run), "--format", "rosflight", "--out", str(run / "model.yaml")]
    assert main(words) == 2
    assert "'cdrw' may name several; give the one that was used as --aircraft" in capsys.readouterr().err
    assert main([*words, "--aircraft", "cdrw"]) == 0


def test_valid_estimates_replace_the_files(run, capsys):
    out = run / "model.yaml"
    assert main(["export", str(run), "--format", "rosflight", "--out", str(out)]) == 0
    values = yaml.safe_load(out.read_text())["/**"]["ros__parameters"]
    assert values["C_m_alpha"] == -0.31
    assert values["C_ell_p"] == load_aircraft("cdrw").derivatives["Cl_p"].value
    assert "not valid, kept as in the aircraft file: Cl_p, Cn_r" in capsys.readouterr().out


@pytest.mark.parametrize("form", ["jsbsim", "gazebo", "rosflight"])
def test_an_aircraft_may_be_exported_too(tmp_path, capsys, form):
    assert main(["export", "kestrel", "--format", form, "--out", str(tmp_path / "model"), "--quiet"]) == 0
    assert (tmp_path / "model").stat().st_size > 500
    assert capsys.readouterr().out == ""


def test_effects_go_into_jsbsim(run):
    effect = "actuator_lag:time_constant=0.05"
    assert main(["export", str(run), "--format", "jsbsim", "--out", str(run / "m.xml"), "--effect", effect]) == 0
    assert [float(lag.text) for lag in parse(run / "m.xml").iter("lag")] == [20.0] * 3


@pytest.mark.parametrize("form", ["gazebo", "rosflight"])
def test_a_corrected_file_is_exported_with_its_effects(tmp_path, capsys, form):
    """What a diagnosis wrote: the slow servo is in the model, and what the format has not is said, a line each."""
    effects = {"actuator_lag": dict.fromkeys(("elevator", "aileron"), UncertainValue(0.1)),
               "actuator_backlash": {"rudder": UncertainValue(0.02)}}  # fmt: skip
    delays = {**NO_DELAYS, "imu": UncertainValue(0.02)}
    corrected = replace(load_aircraft("kestrel"), effects=effects, delays=delays)
    (tmp_path / "corrected.yaml").write_text(dump_aircraft(corrected))
    out = tmp_path / "model"
    assert main(["export", str(tmp_path / "corrected.yaml"), "--format", form, "--out", str(out)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{out}: kestrel for {form}; what {form} does not hold:"
    assert [line for line in lines if line.startswith("- actuator_backlash: ")]
    assert "- imu_delay: it lies in the flight's instruments, not in the simulator" in lines
    assert not [line for line in lines if line.startswith("- actuator_lag")]
    found = {"gazebo": read_gazebo, "rosflight": read_rosflight}[form](out, 16.0).aircraft
    lags = found.effects["actuator_lag"]
    assert (lags["elevator"].value, lags["aileron"].value) == pytest.approx((0.1, 0.1))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nobody", "--format", "jsbsim"], "nobody"),
        (["kestrel", "--format", "jsbsim", "--aircraft", "cdrw"], "kestrel is an aircraft itself; give one of the two"),
        (["{run}", "--format", "jsbsim", "--aircraft", "cdfp"], "is 'cdfp', but {run} was estimated with 'cdrw'"),
        (["{run}", "--format", "jsbsim", "--aircraft", "{run}/other.yaml"], "geometry.S is 0.9, but {run} was"),
        (["missing/summary.json", "--format", "jsbsim"], "not found"),
        (
            ["{run}/summary.json", "--format", "gazebo", "--effect", "actuator_backlash:elevator=0.02"],
            "'actuator_backlash' cannot be exported to gazebo: Gazebo's joint controllers have no free play",
        ),
        (["kestrel", "--format", "jsbsim", "--model", "{run}/own.yaml"], "is corrected by sysid gap --simulator"),
        (["kestrel", "--format", "gazebo", "--model", "{run}/own.yaml"], "not XML"),
        (["kestrel", "--format", "rosflight", "--model", "{run}/own.yaml"], "not parameters of rosflight_sim"),
        (["{run}/broken.json", "--format", "gazebo"], "not the summary.json of a run"),
        (["cdrw", "--format", "jsbsim", "--out", "{run}/summary.json/model.xml"], "cannot be written"),
        (["{run}", "--format", "jsbsim", "--out", "{run}/summary.json"], "holds something else; give --force"),
        (["{run}/own.yaml", "--format", "jsbsim", "--out", "{run}/own.yaml", "--force"], "is the input"),
    ],
)
def test_bad_input_is_one_line(run, capsys, arguments, said):
    (run / "broken.json").write_text("{")
    (run / "own.yaml").write_text("name: mine")
    cdrw = load_aircraft("cdrw")
    (run / "other.yaml").write_text(dump_aircraft(replace(cdrw, geometry=replace(cdrw.geometry, S=0.9))))
    words = [word.replace("{run}", str(run)) for word in arguments]
    if "--out" not in words:
        words += ["--out", str(run / "model")]
    assert main(["export", *words]) == 2
    message = capsys.readouterr().err
    assert said.replace("{run}", str(run)) in message
    assert message.count("\n") == 1


ODD = [
    ({"aircraft": "../secret.yaml", "written": {}}, "'../secret.yaml' may name several; give"),
    ({"aircraft": "{run}/secret.yaml", "written": {"files": 3}}, "give the one that was used as --aircraft"),
    ({"derivatives": [1]}, "not the summary.json of a run"),
    ({"derivatives": {"Cm_alpha": 3.0}}, "not the summary.json of a run"),
    ({"derivatives": {"Cm_alpha": {"value": "-0.3", "valid": True}}}, "value is '-0.3', expected a finite number"),
    ({"derivatives": {"Cm_alpha": {"value": 1e999, "valid": True}}}, "value is inf, expected a finite number"),
    ({"derivatives": {"Cm_alpha": {"value": -0.3, "standard_error": [1], "valid": True}}}, "standard_error is [1]"),
    ({"derivatives": {"Cm_alhpa": {"value": -0.3, "valid": True}}}, "has no such derivative"),
]


@pytest.mark.parametrize(("change", "said"), ODD)
def test_odd_summaries_are_one_line(run, capsys, change, said):
    """The aircraft of a summary is a name: a file that it leads to is not read."""
    (run / "secret.yaml").write_text("secret")
    written = {"files": ["aircraft.yaml"]}
    changed = json.dumps({**SUMMARY, "written": written, **change}).replace("{run}", str(run))
    (run / "summary.json").write_text(changed)
    assert main(["export", str(run), "--format", "jsbsim", "--out", str(run / "m.xml")]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1


@pytest.mark.parametrize("form", ["jsbsim", "gazebo", "rosflight"])
def test_a_name_with_a_newline_and_marks_injects_nothing(form):
    """The name of the aircraft file is text of the user's: in YAML a second line of it would be a key."""
    name = 'a\n/**:\n  ros__parameters:\n    mass: 99.0\n"><evil/>\x00'
    aircraft = replace(load_aircraft("cdrw"), name=name, source=name)
    text = {"jsbsim": export_jsbsim, "gazebo": gazebo_model, "rosflight": rosflight_parameters}[form](aircraft).text
    if form == "rosflight":
        assert yaml.safe_load(text)["/**"]["ros__parameters"]["mass"] == load_aircraft("cdrw").mass
    else:
        assert not list(fromstring(text).iter("evil"))


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
@pytest.mark.parametrize("writer", [export_jsbsim, gazebo_model, rosflight_parameters])
def test_a_value_that_is_not_finite_is_refused(writer, value):
    aircraft = load_aircraft("cdrw")
    derivatives = {**aircraft.derivatives, "CL_q": Derivative(value)}
    with pytest.raises(InputError, match="correct the estimate"):
        writer(replace(aircraft, derivatives=derivatives))


@pytest.mark.parametrize("name", ["kestrel", "cdrw", "cdfp"])
@pytest.mark.parametrize("writer", [gazebo_model, rosflight_parameters])
def test_level_flight_and_its_slopes_are_the_files(writer, name):
    """All that is left out of our own aircraft is the drag's form, and in Gazebo the pressure in sideslip."""
    lines = writer(load_aircraft(name)).left_out
    assert not [line for line in lines if not line.startswith(("alpha from", "beta from", "de from"))]
    assert all("CD by" in line for line in lines)
