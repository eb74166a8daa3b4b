"""Programs end as they should when they are told to stop. Truth: exit codes; rclpy's own signal handling."""

import contextlib
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rclpy

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


STOPPED_BEFORE_SERVING = """
import sys
import rclpy
from sysid_node.ros.support.spin import run_program, serve, until_shutdown

def program():
    with until_shutdown():
        node = rclpy.create_node("early")
        rclpy.shutdown()
        serve(node)
    print("and the rest")

sys.exit(run_program(program))
"""


STOPPED_WHILE_ROS_BEGINS = """
import os, signal, sys, time
import rclpy
from sysid_node.ros.support.spin import run_program

begin = rclpy.init

def slow_beginning(**options):
    os.kill(os.getpid(), signal.{signal})  # before there is anything that could be shut down
    begin(**options)

def program():
    end = time.monotonic() + 10.0
    while rclpy.ok() and time.monotonic() < end:
        time.sleep(0.01)
    print("ended by itself" if rclpy.ok() else "told to stop")

rclpy.init = slow_beginning
sys.exit(run_program(program))
"""

STOPPED_WHILE_A_NODE_IS_TAKEN_UP = """
import os, signal, sys, time
from rclpy.node import Node
from rclpy.waitable import NumberOfEntities, Waitable
from std_msgs.msg import String
from sysid_node.ros.support.spin import run_node

class Part(Waitable):
    looked_at = 0

    def add_to_wait_set(self, wait_set):
        pass

    def is_ready(self, wait_set):
        return False

    def get_num_entities(self):
        Part.looked_at += 1
        if Part.looked_at == 2:
            os.kill(os.getpid(), signal.{signal})
            time.sleep(0.2)  # time enough to shut ROS down
        return NumberOfEntities()

class Early(Node):
    def __init__(self):
        super().__init__("early")
        self.create_subscription(String, "text", lambda message: None, 10)
        for _ in range(4):
            self.add_waitable(Part(self.default_callback_group))

code = run_node(Early, "")
print("looked at", Part.looked_at)
sys.exit(code)
"""


def ended(text: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", text, *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)


def test_ctrl_c_and_sigterm_let_the_program_end_instead_of_raising_in_the_middle_of_it() -> None:
    for name in ("SIGINT", "SIGTERM"):
        done = ended(INTERRUPTED.format(signal=name))
        assert (done.returncode, done.stdout, done.stderr) == (0, "told to stop\n", "")


def test_a_signal_that_comes_while_ros_begins_is_not_lost() -> None:
    for name in ("SIGINT", "SIGTERM"):
        done = ended(STOPPED_WHILE_ROS_BEGINS.format(signal=name))
        assert (done.returncode, done.stdout, done.stderr) == (0, "told to stop\n", "")


def test_a_signal_that_comes_while_the_executor_takes_the_node_up_does_not_abort_the_process() -> None:
    """It did: rclpy's events executor ends with "Destroying callback manager with callbacks remaining"."""
    for name in ("SIGINT", "SIGTERM"):
        done = ended(STOPPED_WHILE_A_NODE_IS_TAKEN_UP.format(signal=name))
        assert (done.returncode, done.stdout, done.stderr) == (0, "looked at 4\n", "")


def test_what_ros_refuses_while_it_shuts_down_is_no_failure_and_everything_else_is() -> None:
    assert ended(ASKED_TOO_LATE.format(before="rclpy.shutdown()")).returncode == 0
    failed = ended(ASKED_TOO_LATE.format(before="pass"))
    assert failed.returncode == 1
    assert failed.stderr.endswith("ValueError: not reached where ROS is down\n")


def test_what_comes_after_serving_is_done_wherever_ros_is_shut_down() -> None:
    done = ended(STOPPED_BEFORE_SERVING)
    assert (done.returncode, done.stdout, done.stderr) == (0, "and the rest\n", "")


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


def until_there(name: str) -> None:
    """Wait until there is a node of this name."""
    node, end = rclpy.create_node("onlooker"), time.monotonic() + 60.0
    while name not in node.get_node_names():
        assert time.monotonic() < end, f"{name} never came"
        time.sleep(0.05)
    node.destroy_node()


def until_importing(process: int) -> None:
    """Wait until a process has loaded NumPy, which nodes import after what makes them end quietly."""
    maps, end = Path(f"/proc/{process}/maps"), time.monotonic() + 60.0
    while "_multiarray_umath" not in maps.read_text(encoding="utf-8"):
        assert time.monotonic() < end, "it never began"
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("serving", "times", "terminal"), [(False, 1, False), (False, 2, True), (True, 2, False), (True, 1, True)]
)
def test_a_node_ends_with_code_0_and_without_a_word(ros: None, serving: bool, times: int, terminal: bool) -> None:
    """By SIGINT, or Ctrl-C in a terminal, once or twice in a tenth of a second. While modules are imported, too."""
    master, slave = pty.openpty()
    node = ["-m", "sysid_node.ros.fault_monitor", "--ros-args", "-p", "aircraft:=cdrw"]
    attach = ["-c", "import os, sys; os.login_tty(0); os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"]
    command = [sys.executable, *(attach if terminal else []), *node]
    process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave)
    os.close(slave)
    if serving:
        until_there("fault_monitor")
    else:
        until_importing(process.pid)
    for _ in range(times):
        if terminal:
            os.write(master, b"\x03")
        else:
            process.send_signal(signal.SIGINT)
        time.sleep(0.1)
    code, text = process.wait(60.0), ""
    with contextlib.suppress(OSError):  # Linux: nothing was written, and the other end is closed
        text = os.read(master, 100_000).decode()
    os.close(master)
    assert code == 0, text
    for word in ("Traceback", "FATAL", "KeyboardInterrupt"):
        assert word not in text


@pytest.mark.parametrize("node", ["identifier", "adaptive_controller", "adapter", "recorder"])
def test_help_helps(node: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", f"sysid_node.ros.{node}", "--help"], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0
    assert done.stdout.startswith(f"usage: {'' if node == 'recorder' else 'ros2 run sysid_node '}{node}")
    if node == "adaptive_controller":
        assert "gain_margin (2.0): Factor by which" in done.stdout
    assert done.stderr == ""
