"""A virtual environment that holds ROS packages names itself to ROS, and nothing else is touched."""

import os
import subprocess
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


def test_linear_algebra_of_the_nodes_has_one_thread() -> None:
    """Every node's module comes after this package, so the variable is there when NumPy is imported."""
    program = "import os, sys, sysid_node.ros; print(os.environ.get('OPENBLAS_NUM_THREADS'), 'numpy' in sys.modules)"
    kept = {k: v for k, v in os.environ.items() if k not in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", program], env=kept, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "False"]
