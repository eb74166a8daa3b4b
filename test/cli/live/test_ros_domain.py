"""A domain of its own, on this computer alone; truth: the environment that ROS and Fast DDS read."""

import os

import pytest

from sysid_node.cli.live.ros_domain import LOCAL, PROFILE, RANGE, own_domain


@pytest.mark.parametrize(
    ("before", "by_profile"),
    [
        ({}, True),
        ({"RMW_IMPLEMENTATION": "rmw_fastrtps_dynamic_cpp"}, True),
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, False),
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp", PROFILE: f"/share/{LOCAL}"}, False),
        ({PROFILE: "/my/profile.xml"}, False),
        ({PROFILE: f"/share/{LOCAL}"}, True),
    ],
)
def test_only_this_computer(before: dict[str, str], by_profile: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "environ", dict(before))
    own_domain()
    assert os.environ.get(RANGE) == (None if by_profile else "LOCALHOST")
    assert not by_profile or os.environ[PROFILE].endswith(LOCAL)
    assert 1 <= int(os.environ["ROS_DOMAIN_ID"]) <= 100


def test_what_is_named_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever lets other computers hear the nodes must not be overruled by the profile."""
    named = {"ROS_DOMAIN_ID": "7", RANGE: "SUBNET"}
    monkeypatch.setattr(os, "environ", dict(named))
    own_domain()
    assert os.environ == named
