"""What importing the nodes' package sets in the environment, and what it leaves as it was."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from harness import Probe, ended, start

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


@pytest.mark.parametrize("named", [None, "DEFAULT"])
def test_nodes_leave_shared_memory_where_no_other_transports_are_named(named: str | None) -> None:
    program = "import os, sysid_node.ros; print(os.environ['FASTDDS_BUILTIN_TRANSPORTS'])"
    kept = {k: v for k, v in os.environ.items() if k != "FASTDDS_BUILTIN_TRANSPORTS"}
    named_too = kept if named is None else {**kept, "FASTDDS_BUILTIN_TRANSPORTS": named}
    done = subprocess.run([sys.executable, "-c", program], env=named_too, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == (named or "UDPv4")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.parametrize(
    ("transports", "profile", "shared"), [(None, True, 0), (None, False, 0), ("DEFAULT", False, 1)]
)
def test_shared_memory_of_fast_dds_is_there_only_where_it_is_asked_for(
    probe: Probe, transports: str | None, profile: bool, shared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Truth: the memory of its process. The library of its messages is loaded once its topics are there."""
    if not profile:
        monkeypatch.delenv("FASTRTPS_DEFAULT_PROFILES_FILE")
        monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    if transports:
        monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", transports)
    with ended(start("identifier", "--ros-args", "-p", "aircraft:=cdrw")) as node:
        maps = Path(f"/proc/{node.pid}/maps")
        probe.until(lambda: "libsysid_msgs__rosidl_typesupport_fastrtps" in maps.read_text(encoding="utf-8"))
        assert ("/dev/shm/fastrtps" in maps.read_text(encoding="utf-8")) == shared
