"""Programs end as they should when they are told to stop. Truth: exit codes; rclpy's own signal handling."""

import subprocess
import sys

INTERRUPTED = """
import os, signal, sys, time
import rclpy
from sysid_node.ros.support.spin import run_program

def program():
    os.kill(os.getpid(), signal.{signal})
    end = time.monotonic() + 10.0
    while rclpy.ok() and time.monotonic() < end:
        time.sleep(0.01)  # where Python would raise KeyboardInterrupt
    print("ended by itself" if rclpy.ok() else "told to stop")

sys.exit(run_program(program))
"""

ASKED_TOO_LATE = """
import sys
import rclpy
from sysid_node.ros.support.spin import run_program

def program():
    {before}
    rclpy.create_node("late")
    raise ValueError("not reached where ROS is down")

sys.exit(run_program(program))
"""


def ended(text: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", text, *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)


def test_ctrl_c_and_sigterm_let_the_program_end_instead_of_raising_in_the_middle_of_it() -> None:
    for signal in ("SIGINT", "SIGTERM"):
        done = ended(INTERRUPTED.format(signal=signal))
        assert (done.returncode, done.stdout, done.stderr) == (0, "told to stop\n", "")


def test_what_ros_refuses_while_it_shuts_down_is_no_failure_and_everything_else_is() -> None:
    assert ended(ASKED_TOO_LATE.format(before="rclpy.shutdown()")).returncode == 0
    failed = ended(ASKED_TOO_LATE.format(before="pass"))
    assert failed.returncode == 1
    assert failed.stderr.endswith("ValueError: not reached where ROS is down\n")


def test_arguments_that_ros_cannot_read_are_one_line() -> None:
    done = ended(INTERRUPTED.format(signal="SIGINT"), "--ros-args", "-p", "nonsense")
    assert done.returncode == 2
    lines = done.stderr.splitlines()  # the first is rcl's own
    assert len(lines) == 2 and "arguments after --ros-args" in lines[1]


def test_a_simulator_without_its_libraries_ends_with_one_line() -> None:
    """It was a traceback of 18 lines."""
    hidden = "import sys; sys.modules['jax'] = None; from sysid_node.ros.flight_simulator import main; main()"
    done = ended(hidden)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "flight_simulator needs jax" in line
    assert "pip install -r requirements/desk.txt" in line
