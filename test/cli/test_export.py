"""``sysid export``: what it reads, what it keeps, what it says."""

import json
from xml.etree.ElementTree import parse

import pytest
import yaml

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main

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
    (tmp_path / "summary.json").write_text(json.dumps(SUMMARY))
    return tmp_path


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


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nobody", "--format", "jsbsim"], "nobody"),
        (["missing/summary.json", "--format", "jsbsim"], "not found"),
        (
            ["{run}/summary.json", "--format", "gazebo", "--effect", "actuator_lag:time_constant=0.1"],
            "cannot be exported",
        ),
        (["{run}/broken.json", "--format", "gazebo"], "not the summary.json of a run"),
        (["cdrw", "--format", "jsbsim", "--out", "{run}/none/model.xml"], "cannot be written"),
    ],
)
def test_bad_input_is_one_line(run, capsys, arguments, said):
    (run / "broken.json").write_text("{")
    words = [word.replace("{run}", str(run)) for word in arguments]
    if "--out" not in words:
        words += ["--out", str(run / "model")]
    assert main(["export", *words]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1
