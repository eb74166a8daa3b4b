"""A ROS domain of its own for a command that runs nodes."""

from __future__ import annotations

import os


def own_domain() -> None:
    """Choose a ROS domain that no other program uses, on this computer only; call it before rclpy is imported."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
