"""A ROS domain of its own for a command that runs nodes."""

from __future__ import annotations

import os
from pathlib import Path

from sysid_node.aircraft.load import aircraft_folders

#: Names the profile that Fast DDS takes.
PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"

#: The profile for programs of one computer, in the folder ``config``.
LOCAL = "local_udp.xml"


def own_domain() -> None:
    """Choose a ROS domain that no other program uses, on this computer only; call it before rclpy is imported.

    Fast DDS is told so by its profile ``config/local_udp.xml``, other middleware, and Fast DDS where the environment
    names another profile, by ROS's variable.
    """
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    found = [path for folder in aircraft_folders() if (path := folder.parent / LOCAL).is_file()]
    if os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp").startswith("rmw_fastrtps") and found:
        os.environ.setdefault(PROFILE, str(found[0]))
    if Path(os.environ.get(PROFILE, "")).name != LOCAL:
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
