"""A virtual environment that holds ROS packages names itself to ROS, and nothing else is touched."""

import os
import sys
from pathlib import Path

import pytest

from sysid_node.ros import find_packages


@pytest.mark.parametrize(
    ("holds_packages", "before", "after"),
    [(True, None, "prefix"), (True, "/opt/ros/jazzy", "/opt/ros/jazzy"), (False, None, None)],
)
def test_environment(
    holds_packages: bool, before: str | None, after: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if holds_packages:
        (tmp_path / "share" / "ament_index").mkdir(parents=True)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(os, "environ", {} if before is None else {"AMENT_PREFIX_PATH": before})
    find_packages()
    assert os.environ.get("AMENT_PREFIX_PATH") == (str(tmp_path) if after == "prefix" else after)
