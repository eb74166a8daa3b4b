"""Fixtures of the tests that need ROS; where it is not installed none of them is collected."""

import os
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from sysid_node.flight.bag.writer import write_streams

if find_spec("rclpy") is None:
    collect_ignore_glob = ["test_*.py", "support/test_*.py"]
else:
    import rclpy
    from harness import Probe, made_up_streams

    import sysid_node.ros  # finds sysid_msgs in a virtual environment
    from sysid_node.cli.live.ros_domain import own_domain


@pytest.fixture(scope="session")
def ros() -> Iterator[None]:
    """ROS in a domain of this run's own, so that neither other runs nor other workers are heard."""
    assert sysid_node.ros
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    run = os.getppid() if worker else os.getpid()  # workers of one run have one parent
    os.environ["ROS_DOMAIN_ID"] = str(1 + (3 * run + int(worker.removeprefix("gw") or 0)) % 100)
    own_domain()
    rclpy.init(args=["--ros-args", "-p", "autostart:=false"])
    yield
    rclpy.try_shutdown()


@pytest.fixture
def probe(ros: None) -> "Iterator[Probe]":
    """A node that speaks and listens."""
    one = Probe()
    yield one
    one.close()


@pytest.fixture(scope="session")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of 12 s."""
    path = tmp_path_factory.mktemp("bags") / "made_up"
    write_streams(path, made_up_streams(12.0))
    return path
