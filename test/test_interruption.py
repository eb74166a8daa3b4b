"""Signals end a process at once, in one line, with its own actions done: measured on processes of their own."""

import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import pytest

import sysid_node
from sysid_node.version import VERSION

ROOT = Path(__file__).resolve().parents[1]

WORK = """
import sys, threading, time, pathlib
from sysid_node import interruption
interruption.end_on_signals(lambda number: print("ended by", number, file=sys.stderr))
here = pathlib.Path(sys.argv[1])
with interruption.on_interrupt(lambda: (here / "undone").touch()):
    {before}
    (here / "ready").touch()
    {work}
"""


def ended(folder, number, work, before="pass"):
    """Exit code and stderr of a process that was sent a signal while it worked."""
    command = [sys.executable, "-c", WORK.format(work=work, before=before), str(folder)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        while not (folder / "ready").exists():
            time.sleep(0.01)
        process.send_signal(number)
        _, said = process.communicate(timeout=10)
    return process.returncode, said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_in_one_line(tmp_path, number):
    assert ended(tmp_path, number, "time.sleep(60)") == (128 + number, f"ended by {int(number)}\n")
    assert (tmp_path / "undone").exists()


def test_a_signal_that_arrives_where_exceptions_are_lost_is_not(tmp_path):
    # an exception that is raised while an object is deleted is printed and forgotten by Python
    work = "type('Lost', (), {'__del__': lambda self: time.sleep(60)})(); print('went on', file=sys.stderr)"
    assert ended(tmp_path, signal.SIGINT, work) == (130, "ended by 2\n")


def test_what_is_indivisible_is_finished_first(tmp_path):
    before = "lock = interruption.indivisible(); lock.__enter__()"
    work = "time.sleep(0.5); (here / 'whole').touch(); lock.__exit__(None, None, None); time.sleep(60)"
    assert ended(tmp_path, signal.SIGTERM, work, before)[0] == 143
    assert (tmp_path / "whole").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("number", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")])
def test_a_command_leaves_nothing_half_written(number, word):
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "sysid_node.cli", "replay", str(ROOT / "bags" / "cdrw_multistep")]
        command += ["--aircraft", "cdrw", "--out", f"{place}/new/out", "--quiet"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT) as process:
            while not Path(place, "new", "out", ".sysid-unfinished").exists():
                time.sleep(0.02)
            process.send_signal(number)
            _, said = process.communicate(timeout=20)
        assert (process.returncode, said) == (128 + number, f"sysid replay: {word}\n")
        assert not any(Path(place).iterdir())


def test_there_is_one_version():
    assert sysid_node.__version__ == VERSION
    assert f'version="{VERSION}"' in (ROOT / "setup.py").read_text(encoding="utf-8")
    assert f"<version>{VERSION}</version>" in (ROOT / "package.xml").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8")).get("project", {})
    assert project.get("version", VERSION) == VERSION
