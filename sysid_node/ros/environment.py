"""Where ROS finds its packages, when they are installed into a virtual environment."""

import os
import sys
from pathlib import Path


def find_packages() -> None:
    """Name this virtual environment to ROS where it holds packages and nothing else was named.

    ROS looks packages and message libraries up in the folders of AMENT_PREFIX_PATH. A sourced workspace has set it;
    in a virtual environment nobody needs to, if this runs before the first message type is used.
    """
    if Path(sys.prefix, "share", "ament_index").is_dir():
        os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)
