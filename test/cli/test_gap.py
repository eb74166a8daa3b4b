"""``sysid gap``: bad input is one line and exit code 2."""

from pathlib import Path

import pytest

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main

BAG = Path(__file__).resolve().parents[2] / "bags" / "cdrw_multistep"


def said(capsys: pytest.CaptureFixture[str]) -> str:
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_a_missing_bag_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gap", str(tmp_path / "nowhere"), "--aircraft", "cdrw", "--out", str(tmp_path / "out")]) == 2
    assert "does not exist" in said(capsys)


@pytest.mark.skipif(not BAG.is_dir(), reason="the bundled flights are not here")
def test_a_file_without_tolerances_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(line.partition(", tolerance")[0] + ("}" if ", tolerance" in line else "")
                     for line in dump_aircraft(load_aircraft("cdrw")).splitlines())  # fmt: skip
    path = tmp_path / "bare.yaml"
    path.write_text(text, encoding="utf-8")
    assert main(["gap", str(BAG), "--aircraft", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert "tolerance" in said(capsys)


@pytest.mark.skipif(not BAG.is_dir(), reason="the bundled flights are not here")
def test_the_flight_fitted_cannot_be_held_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["gap", str(BAG), "--holdout", str(BAG), "--aircraft", "cdrw", "--out", str(tmp_path / "out"), "--quiet"]
    assert main(words) == 2
    assert "same flight" in said(capsys)
