"""Processes beside a command: measured on processes of their own."""

import os
import signal
import subprocess
import sys
import time

#: A command that starts one process after another, of which each takes a moment to end, until a signal comes.
MANY = """
import contextlib, sys, time
from pathlib import Path
from sysid_node.cli.live.processes import started
from sysid_node.interruption import end_on_signals
SLOW = "import signal, sys, time; signal.signal(2, lambda *_: (time.sleep(0.3), sys.exit())); time.sleep(60)"
end_on_signals(lambda number: None)
with contextlib.ExitStack() as stack, Path(sys.argv[1]).open("wb") as log:
    while True:
        process = stack.enter_context(started([sys.executable, "-c", SLOW], log))
        print(process.pid, flush=True)
        time.sleep(0.1)
"""


def lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_signal_while_processes_are_started_leaves_none(tmp_path) -> None:
    with subprocess.Popen([sys.executable, "-c", MANY, str(tmp_path / "log")], stdout=subprocess.PIPE) as command:
        assert command.stdout is not None
        first = int(command.stdout.readline())
        time.sleep(0.2)
        command.send_signal(signal.SIGTERM)
        begun = [first, *map(int, command.stdout.read().split())]
        assert command.wait(60.0) == 143
    assert [process for process in begun if lives(process)] == []
