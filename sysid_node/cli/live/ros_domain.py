"""A folder for results and a ROS domain of its own: what a command that runs nodes needs first."""

from __future__ import annotations

import os
from pathlib import Path

from sysid_node.errors import InputError


def make_folder(out: Path) -> None:
    """Make the folder of ``--out``. Raises InputError where that cannot be done."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {out}: cannot be made ({error.strerror}); give another folder") from None


def own_domain() -> None:
    """Choose a ROS domain that no other program uses, on this computer only; call it before rclpy is imported."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
