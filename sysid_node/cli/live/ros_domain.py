"""A ROS domain of its own for a command that runs nodes."""

from __future__ import annotations

import os
from pathlib import Path

from sysid_node.aircraft.load import aircraft_folders

#: Names the profile that Fast DDS takes.
PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"

#: The profile for programs of one computer, in the folder ``config``.
LOCAL = "local_udp.xml"

#: Says how far ROS looks for other programs.
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


def own_domain() -> None:
    """Choose a ROS domain that no other program uses, on this computer only; call it before rclpy is imported.

    Fast DDS is told so by its profile ``config/local_udp.xml``. Other middleware is told by ROS's variable, and so is
    Fast DDS where the environment names another profile. Where the variable is set already, it stays as it is.
    """
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    if RANGE in os.environ:
        return
    found = [path for folder in aircraft_folders() if (path := folder.parent / LOCAL).is_file()]
    fast_dds = os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp").startswith("rmw_fastrtps")
    if fast_dds and found:
        os.environ.setdefault(PROFILE, str(found[0]))
    if not fast_dds or Path(os.environ.get(PROFILE, "")).name != LOCAL:
        os.environ[RANGE] = "LOCALHOST"
