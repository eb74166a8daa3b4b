"""The bench of the live node: told to stop in the middle of a flight it ends quietly, with all that it started."""

import signal
import subprocess
import sys
import time

import pytest
from harness import ROOT


@pytest.mark.slow
@pytest.mark.parametrize("told", [signal.SIGTERM, signal.SIGINT], ids=str)
def test_told_to_stop_it_ends_without_a_traceback(ros: None, told: signal.Signals) -> None:
    """Exit code 0, as run_program promises; what it started ends too, else its output would never end."""
    command = [sys.executable, "-u", "-m", "bench.speed.live", "--seconds", "60"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
    assert process.stdout is not None
    assert "400 Hz IMU" in process.stdout.readline()
    time.sleep(2.0)  # the node and the flight are starting
    process.send_signal(told)
    text, _ = process.communicate(timeout=60.0)
    assert "Traceback" not in text
    assert process.returncode == 0
