"""Names and message types of the topics that describe a flight."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from sysid_node.errors import InputError

IMU = "imu/data"
AIR_DATA = "air_data"
ACTUATORS = "actuators"
EXCITATION = "actuators/excitation"  # of the exciter, to the controller

INPUT_TOPICS: Mapping[str, str] = MappingProxyType(
    {
        IMU: "sensor_msgs/msg/Imu",
        AIR_DATA: "sysid_msgs/msg/AirData",
        ACTUATORS: "sensor_msgs/msg/JointState",
    }
)

#: The topic on which the node ``identifier`` publishes, and its type.
DERIVATIVES = "/identifier/derivatives"
DERIVATIVES_TYPE = "sysid_msgs/msg/DerivativeEstimates"


def topic_names(remaps: Iterable[str] = ()) -> dict[str, str]:
    """Absolute names of the input topics, after remaps such as ``imu/data:=/mavros/imu/data``.

    Raises InputError where a remap is malformed or names no input topic.
    """
    names = {topic: f"/{topic}" for topic in INPUT_TOPICS}
    for remap in remaps:
        ours, separator, theirs = remap.partition(":=")
        if not separator or not theirs:
            raise InputError(f"topic {remap!r}: expected OURS:=THEIRS, e.g. {IMU}:=/mavros/imu/data")
        if ours.lstrip("/") not in names:
            raise InputError(f"topic {remap!r}: {ours!r} is none of {', '.join(INPUT_TOPICS)}")
        names[ours.lstrip("/")] = f"/{theirs.lstrip('/')}"
    return names
