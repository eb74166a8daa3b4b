"""Topic names and remaps."""

import pytest

from sysid_node.errors import InputError
from sysid_node.flight.topics import topic_names


def test_default_names_are_the_contract():
    assert topic_names() == {"imu/data": "/imu/data", "air_data": "/air_data", "actuators": "/actuators"}


def test_remap_with_or_without_slashes():
    assert topic_names(["/imu/data:=mavros/imu/data"])["imu/data"] == "/mavros/imu/data"
    assert topic_names(["imu/data:=/mavros/imu/data"])["imu/data"] == "/mavros/imu/data"


@pytest.mark.parametrize("remap", ["imu/data", "imu/data:=", "imu:=/x", ":=/x"])
def test_wrong_remap_is_named(remap):
    with pytest.raises(InputError, match=f"topic '{remap}'"):
        topic_names([remap])
