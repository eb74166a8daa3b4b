"""``sysid aircraft``: what it prints and writes."""

import contextlib
import io
import json
import shutil
import subprocess
import sys

import pytest

from sysid_node.aircraft.load import aircraft_folders
from sysid_node.api import load, replay
from sysid_node.cli.main import main

CDRW = aircraft_folders()[0] / "cdrw.yaml"


def sysid(*arguments):
    return main(["aircraft", *map(str, arguments)])


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    """The folder of the handbook of cdrw, and what the terminal showed."""
    folder = tmp_path_factory.mktemp("aircraft") / "book"
    with contextlib.redirect_stdout(io.StringIO()) as said:
        assert sysid("cdrw", "--out", folder) == 0
    return folder, said.getvalue()


@pytest.mark.slow
def test_a_folder_has_page_and_numbers(book, tmp_path, capsys):
    folder, said = book
    shutil.copytree(folder, tmp_path / "book")
    assert "Dutch roll" in said and "none of" in said
    content = json.loads((tmp_path / "book" / "aircraft.json").read_text())
    assert content["modes"]["spiral"]["stable"] is False
    assert content["written"]["files"] == ["aircraft.json", "report.html"]
    page = (tmp_path / "book" / "report.html").read_text()
    assert "What looks unusual" in page and 'class="plot"' in page
    assert sysid("cdrw", "--no-budget", "--out", tmp_path / "book", "--quiet") == 0  # its own folder is written again
    assert main(["report", str(tmp_path / "book")]) == 2
    assert "sysid aircraft" in capsys.readouterr().err


@pytest.mark.slow
def test_the_error_budget_is_that_of_a_replay_of_the_same_flight(book, tmp_path):
    """Truth: the summary of a replay of a flight by `sysid simulate`, of another seed and other rates."""
    folder, said = book
    said = " ".join(said.split())
    assert "swing the" in said and "Error budget after" in said
    budget = json.loads((folder / "aircraft.json").read_text())["error_budget"]
    assert "Error budget" in (folder / "report.html").read_text()
    flight = ["--aircraft", "cdrw", "--manoeuvre", "3211:repeat=3", "--seed", "5", "--out", str(tmp_path / "bag")]
    assert main(["simulate", *flight, "--quiet"]) == 0
    replay(load(tmp_path / "bag", "cdrw"), {"publish_rate": 1.0}, judge_faults=False).save(tmp_path / "run")
    found = json.loads((tmp_path / "run" / "summary.json").read_text())
    for name in ("CL_alpha", "Cm_alpha", "Cm_de", "Cl_p", "Cn_beta"):
        other = found["derivatives"][name]["standard_error"]
        assert budget[name]["standard_error"] == pytest.approx(other, rel=0.25)
        assert next(iter(budget[name]["shares"])) == next(iter(found["budget"][name]))


def test_without_a_budget_and_where_there_is_none(tmp_path, capsys):
    assert sysid("cdrw", "--no-budget") == 0
    assert "no error budget: it was not asked for" in capsys.readouterr().out
    text = CDRW.read_text().replace("max_thrust: 30.0", "max_thrust: 0.1")
    (tmp_path / "weak.yaml").write_text(text)
    assert sysid(tmp_path / "weak.yaml", "--out", tmp_path / "weak") == 0
    assert "no error budget: the file cannot be flown" in " ".join(capsys.readouterr().out.split())
    assert json.loads((tmp_path / "weak" / "aircraft.json").read_text())["error_budget"] is None


def test_a_wrong_sign_is_named_with_its_range(tmp_path, capsys):
    text = CDRW.read_text().replace("Cm_alpha: {value: -0.2347", "Cm_alpha: {value: 0.2347")
    (tmp_path / "wrong.yaml").write_text(text)
    assert sysid(tmp_path / "wrong.yaml", "--no-budget") == 0
    said = capsys.readouterr().out
    assert "Cm_alpha = 0.235 1/rad (usual: -4 to 0): positive: unstable in pitch" in " ".join(said.split())


def test_a_number_without_unit_stands_alone(tmp_path, capsys):
    text = CDRW.read_text().replace("Ixx: 0.1903", "Ixx: 0.6")
    (tmp_path / "wrong.yaml").write_text(text)
    assert sysid(tmp_path / "wrong.yaml", "--no-budget") == 0
    assert "Ixx over m b^2 = 0.0667 (usual: 0.003 to 0.06)" in " ".join(capsys.readouterr().out.split())


def test_a_mass_in_grams_is_said_although_there_is_no_level_flight(tmp_path, capsys):
    text = CDRW.read_text().replace("mass: 4.0 ", "mass: 4000.0 ")
    (tmp_path / "grams.yaml").write_text(text)
    assert sysid(tmp_path / "grams.yaml") == 2
    said = capsys.readouterr()
    assert "mass over wing area = " in said.out
    assert "mass in grams or pounds" in said.out
    assert f"sysid aircraft: {tmp_path / 'grams.yaml'}: aircraft cdrw: no level flight" in said.err
    assert sysid(tmp_path / "grams.yaml", "--quiet") == 2
    assert capsys.readouterr().out == ""


def test_an_unknown_name_is_one_line(capsys):
    assert sysid("cdrv") == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_it_starts_light():
    code = "import sys, sysid_node.cli.models.aircraft; sys.exit(bool({'jax', 'rclpy', 'pandas'} & sys.modules.keys()))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
