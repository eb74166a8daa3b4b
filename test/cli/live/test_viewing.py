"""The view beside a flight: it ends with it, whatever the shell has it ignore."""

import subprocess
import sys
from importlib.util import find_spec

import pytest

if find_spec("rclpy") is None or find_spec("rerun") is None:
    pytest.skip("ROS or the viewer is not installed", allow_module_level=True)

#: As started by a shell in the background, or by nohup's relatives: SIGINT is ignored, and so by what it starts.
IN_THE_BACKGROUND = """
import signal, sys, time
from pathlib import Path
signal.signal(signal.SIGINT, signal.SIG_IGN)
from sysid_node.cli.live.viewing import viewer_beside
folder = Path(sys.argv[1])
with viewer_beside("cdrw", folder / "flight.rrd", folder):
    while not any(path.stat().st_size for path in folder.glob("flight.rrd")):
        time.sleep(0.1)
"""


@pytest.mark.slow
def test_it_ends_with_a_flight_that_runs_in_the_background(tmp_path) -> None:
    subprocess.run([sys.executable, "-c", IN_THE_BACKGROUND, str(tmp_path)], check=True, timeout=600)
    assert (tmp_path / "flight.rrd").stat().st_size > 0
