"""The ROS 2 nodes and programs, one a module; what ROS needs of them stands in ``support``.

A node declares its parameters, turns messages into plain numbers and calls the layers below, which need no ROS:
``online`` identifies, ``control`` flies, ``faults`` monitors, ``excite`` excites and ``sim`` simulates. Their results
are published as messages. A module that imports no ROS belongs in the layer whose work it does.
"""

import os
import sys
from pathlib import Path


def find_packages() -> None:
    """Name this virtual environment to ROS where it holds packages and no other place was named.

    ROS looks for packages and message libraries in the folders of AMENT_PREFIX_PATH. A workspace that was sourced has
    set it. In a virtual environment nobody needs to, if this runs before the first message type is used.
    """
    if Path(sys.prefix, "share", "ament_index").is_dir():
        os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)


find_packages()
