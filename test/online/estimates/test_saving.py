"""Estimates saved to a file in flight: complete, or not at all."""

import json
import math
from pathlib import Path

import pytest

from sysid_node.errors import InputError
from sysid_node.online.estimates.saving import save_estimates
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality

ESTIMATES = Estimates(
    2.5,
    {"Cm_alpha": DerivativeEstimate("Cm_alpha", -0.5, 0.1, -0.7, math.nan, True, "ok")},
    {"Cm": FitQuality("Cm", 0.9, 0.01, 30.0, 99)},
)


def save(folder: Path, aircraft: str = "cdrw", node: str = "/identifier") -> Path:
    return save_estimates(
        folder,
        ESTIMATES,
        node=node,
        aircraft=aircraft,
        settings=OnlineSettings(),
        stamp_ns=7,
        samples=99,
        rejected={"imu/data: late": 3},
    )


def test_a_second_save_replaces_the_first_and_leaves_no_other_file(tmp_path: Path) -> None:
    path = save(tmp_path / "new")
    assert path.name == "cdrw-7.json"
    assert save(tmp_path / "new") == path
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_aircraft_of_one_type_that_fly_together_keep_their_files_apart(tmp_path: Path) -> None:
    names = [save(tmp_path, node=f"/fleet/{uav}/identifier").name for uav in ("uav1", "uav2")]
    assert names == ["fleet-uav1-cdrw-7.json", "fleet-uav2-cdrw-7.json"]
    assert json.loads((tmp_path / names[1]).read_text(encoding="utf-8"))["node"] == "/fleet/uav2/identifier"


def test_content_is_json_with_null_for_nan(tmp_path: Path) -> None:
    content = json.loads(save(tmp_path).read_text(encoding="utf-8"))
    assert content["derivatives"]["Cm_alpha"]["value"] == -0.5
    assert content["derivatives"]["Cm_alpha"]["upper"] is None
    assert content["fits"]["Cm"]["samples"] == 99
    assert (content["samples"], content["rejected"], content["data_seconds"]) == (99, {"imu/data: late": 3}, 2.5)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file.*save_directory"):
        save(tmp_path / "file")


@pytest.mark.parametrize("name", ["../../outside", "/tmp/outside", "a/b", "..", "", "x" * 400, "new\nline", "nul\0"])
def test_whatever_the_aircraft_is_called_the_file_is_in_the_folder(tmp_path: Path, name: str) -> None:
    path = save(tmp_path / "here", name)
    assert path.parent == tmp_path / "here"
    assert list(tmp_path.rglob("*.json")) == [path]
    assert json.loads(path.read_text(encoding="utf-8"))["aircraft"] == name


def test_the_path_is_absolute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert save(Path()) == tmp_path / "cdrw-7.json"


def test_the_home_of_the_user_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A parameter passes no shell; a folder called ~ had been made."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert save(Path("~/flights")) == tmp_path / "flights" / "cdrw-7.json"
    with pytest.raises(InputError, match="no home directory"):
        save(Path("~nobody_of_that_name/flights"))
