"""The ROS 2 nodes and programs, one a module; what ROS needs of them stands in ``support``.

A node declares its parameters, turns messages into plain numbers and calls the layers below, which need no ROS:
``online`` identifies, ``control`` flies, ``faults`` monitors, ``excite`` excites and ``sim`` simulates. Their results
are published as messages. A module that imports no ROS belongs in the layer whose work it does.
"""

import os
import signal
import sys
import threading
from pathlib import Path

from sysid_node.linear_algebra import one_thread_for_linear_algebra

PROGRAMS = frozenset(
    {
        *("adapter", "adaptive_controller", "exciter", "fault_monitor"),
        *("flight_simulator", "identifier", "player", "recorder"),
    }
)


def find_packages() -> None:
    """Name this virtual environment to ROS where it holds packages and no other place was named.

    ROS looks for packages and message libraries in the folders of AMENT_PREFIX_PATH. A workspace that was sourced has
    set it. In a virtual environment nobody needs to, if this runs before the first message type is used.
    """
    if Path(sys.prefix, "share", "ament_index").is_dir():
        os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)


def leave_shared_memory() -> None:
    """Let Fast DDS send by UDP alone, unless the environment names other transports (FASTDDS_BUILTIN_TRANSPORTS).

    With its shared memory, a process that takes the place of a killed one at once may never hear a message: a publisher
    that clears up what the killed one has left removes what the new one has made (Fast DDS's issues 5053 and 5469,
    pull request 4728).
    """
    os.environ.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")


def end_quietly() -> None:
    """Let SIGINT and SIGTERM end this process at once with code 0, where it is one of the ``PROGRAMS`` that starts.

    Imports take a second or more, in which Ctrl-C would leave a traceback of the import system. Nothing has begun by
    then that would have to be ended. ``support.spin`` takes the signals over. ``-m`` is the name of a program that
    Python is about to find by its module.
    """
    starting = Path(sys.argv[0] if sys.argv else "").name in ("-m", *PROGRAMS)
    if starting and threading.current_thread() is threading.main_thread():
        for one in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(one) is not signal.SIG_IGN:
                signal.signal(one, lambda *_: os._exit(0))


end_quietly()
one_thread_for_linear_algebra()  # before a node's module imports NumPy
find_packages()
leave_shared_memory()  # before rclpy begins
