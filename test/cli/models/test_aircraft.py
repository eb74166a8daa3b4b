"""``sysid aircraft``: what it prints and writes."""

import json
import subprocess
import sys

from sysid_node.aircraft.load import aircraft_folders
from sysid_node.cli.main import main

CDRW = aircraft_folders()[0] / "cdrw.yaml"


def sysid(*arguments):
    return main(["aircraft", *map(str, arguments)])


def test_a_folder_has_page_and_numbers(tmp_path, capsys):
    assert sysid("cdrw", "--out", tmp_path / "book") == 0
    said = capsys.readouterr().out
    assert "Dutch roll" in said and "none of" in said
    content = json.loads((tmp_path / "book" / "aircraft.json").read_text())
    assert content["modes"]["spiral"]["stable"] is False
    assert content["written"]["files"] == ["aircraft.json", "report.html"]
    page = (tmp_path / "book" / "report.html").read_text()
    assert "What looks unusual" in page and 'class="plot"' in page
    assert sysid("cdrw", "--out", tmp_path / "book", "--quiet") == 0  # its own folder is written again
    assert main(["report", str(tmp_path / "book")]) == 2
    assert "sysid aircraft" in capsys.readouterr().err


def test_a_wrong_sign_is_named_with_its_range(tmp_path, capsys):
    text = CDRW.read_text().replace("Cm_alpha: {value: -0.2347", "Cm_alpha: {value: 0.2347")
    (tmp_path / "wrong.yaml").write_text(text)
    assert sysid(tmp_path / "wrong.yaml") == 0
    said = capsys.readouterr().out
    assert "Cm_alpha = 0.235 1/rad (usual: -4 to 0): positive: unstable in pitch" in " ".join(said.split())


def test_an_unknown_name_is_one_line(capsys):
    assert sysid("cdrv") == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_it_starts_light():
    code = "import sys, sysid_node.cli.models.aircraft; sys.exit(bool({'jax', 'rclpy', 'pandas'} & sys.modules.keys()))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
