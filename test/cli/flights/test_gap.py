"""``sysid gap``: bad input is one line and exit code 2; what it finds can be flown and exported."""

import json
from pathlib import Path

import pytest

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main

BAG = Path(__file__).resolve().parents[3] / "bags" / "cdrw_multistep"


def said(capsys: pytest.CaptureFixture[str]) -> str:
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_a_missing_bag_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gap", str(tmp_path / "nowhere"), "--aircraft", "cdrw", "--out", str(tmp_path / "out")]) == 2
    assert "does not exist" in said(capsys)


@pytest.mark.slow
@pytest.mark.skipif(not BAG.is_dir(), reason="the bundled flights are not here")
def test_a_file_without_tolerances_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(line.partition(", tolerance")[0] + ("}" if ", tolerance" in line else "")
                     for line in dump_aircraft(load_aircraft("cdrw")).splitlines())  # fmt: skip
    path = tmp_path / "bare.yaml"
    path.write_text(text, encoding="utf-8")
    assert main(["gap", str(BAG), "--aircraft", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert "tolerance" in said(capsys)


@pytest.mark.parametrize(
    ("simulator", "words"), [("c172p", "expected jsbsim:NAME"), ("jsbsim:nobody", "no aircraft 'nobody'")]
)
def test_a_simulator_that_is_none_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], simulator: str, words: str
) -> None:
    pytest.importorskip("jsbsim", reason="JSBSim is not installed")
    options = ["--aircraft", "cdrw", "--simulator", simulator, "--out", str(tmp_path / "out"), "--quiet"]
    assert main(["gap", str(BAG), *options]) == 2
    assert words in said(capsys)


@pytest.mark.skipif(not BAG.is_dir(), reason="the bundled flights are not here")
def test_the_flight_fitted_cannot_be_held_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["gap", str(BAG), "--holdout", str(BAG), "--aircraft", "cdrw", "--out", str(tmp_path / "out"), "--quiet"]
    assert main(words) == 2
    assert "same flight" in said(capsys)


@pytest.mark.skipif(not BAG.is_dir(), reason="the bundled flights are not here")
def test_the_same_flight_twice_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Also by another name of the same folder."""
    again = BAG.parent / ".." / BAG.parent.name / BAG.name
    assert main(["gap", str(BAG), str(again), "--aircraft", "cdrw", "--out", str(tmp_path / "out")]) == 2
    assert f"{again}: this flight is given twice; leave it out once" in said(capsys)


@pytest.mark.skipif(not BAG.is_dir(), reason="the bundled flights are not here")
def test_a_real_flight_given_as_a_simulated_one_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["gap", str(BAG), "--aircraft", "cdrw", "--out", str(tmp_path / "out"), "--quiet", "--simulated", str(BAG)]
    assert main(words) == 2
    assert "same recording" in said(capsys)


STEPS = [
    "3211:elevator:amplitude=0.06:width=0.3:start=1:every=8:repeat=2",
    "3211:aileron:amplitude=0.06:width=0.25:start=4:every=8:repeat=2",
    "3211:rudder:amplitude=0.12:width=0.3:start=6:every=8:repeat=2",
]


def fly(out: Path, aircraft: str, effects: list[str], seed: int) -> None:
    """A flight of 18 s in still air."""
    words = ["simulate", "--quiet", "--aircraft", aircraft, "--duration", "18", "--rate", "100", "--seed", str(seed)]
    words += [w for spec in STEPS for w in ("--manoeuvre", spec)]
    assert main([*words, *effects, "--out", str(out)]) == 0


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The diagnosis of a gyro that is off: an effect that no force or moment shows."""
    folder = tmp_path_factory.mktemp("gap")
    for seed in (1, 2):
        fly(folder / f"flight{seed}", "cdrw", ["--effect", "imu_bias:q=0.03"], seed)
    words = ["gap", str(folder / "flight1"), "--holdout", str(folder / "flight2"), "--aircraft", "cdrw", "--quiet"]
    assert main([*words, "--out", str(folder / "out")]) == 0
    return folder


@pytest.mark.slow
def test_a_gyro_that_is_off_is_named_with_its_size(found: Path) -> None:
    gap = json.loads((found / "out" / "gap.json").read_text(encoding="utf-8"))
    assert gap["verdict"] == "explained"
    (cause,) = gap["causes"]
    assert cause["effect"] == "imu_bias"
    assert cause["parameters"]["q"][0] == pytest.approx(0.03, rel=0.05)
    pitch = gap["gap"]["per_channel"]["theta"]
    assert pitch["after"] < 0.3 * pitch["before"]


@pytest.mark.slow
def test_the_gap_is_that_of_short_flights_with_its_interval(found: Path) -> None:
    gap = json.loads((found / "out" / "gap.json").read_text(encoding="utf-8"))["gap"]
    assert gap["measured_by"] == "short_flights" and gap["window_s"] == 2.0 and gap["held_out"]
    low, high = gap["intervals"]["before"]
    assert low < gap["before"] < high and gap["noise_floor"] <= gap["after"] < gap["before"]
    assert gap["ci95"][0] <= gap["shrink_percent"] <= gap["ci95"][1]
    assert gap["forces_and_kinematics"]["window_s"] == pytest.approx(6.0, rel=0.1)  # a third of the flight


@pytest.mark.slow
def test_nothing_unfinished_is_left(found: Path) -> None:
    files = {"gap.json", "where.csv", "candidates.csv", "corrected.yaml", "effects.txt", "flights.csv", "report.html"}
    assert {path.name for path in (found / "out").iterdir()} == files


@pytest.mark.slow
def test_the_corrected_model_can_be_flown(found: Path) -> None:
    effects = (found / "out" / "effects.txt").read_text(encoding="utf-8").split()
    assert effects[0] == "--effect" and effects[1].startswith("imu_bias:")
    fly(found / "corrected", str(found / "out" / "corrected.yaml"), effects, 3)
    truth = json.loads((found / "corrected.truth.json").read_text(encoding="utf-8"))
    assert truth["effects"]["imu_bias"]["q"] == pytest.approx(0.03, rel=0.05)


@pytest.mark.slow
def test_the_corrected_model_can_be_exported(found: Path) -> None:
    words = ["export", str(found / "out" / "corrected.yaml"), "--format", "jsbsim", "--quiet"]
    assert main([*words, "--out", str(found / "model.xml")]) == 0
    assert "<fdm_config" in (found / "model.xml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_begins_with_words(found: Path) -> None:
    page = (found / "out" / "report.html").read_text(encoding="utf-8")
    assert "restarted every 2 s" in page and "imu bias" in page and "Which effects this flight can distinguish" in page
