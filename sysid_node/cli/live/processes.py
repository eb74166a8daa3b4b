"""Nodes of this package as processes."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from sysid_node.interruption import indivisible, on_interrupt

PATIENCE = 10.0  # s for a node to end


@contextlib.contextmanager
def node_process(name: str, arguments: Sequence[str], folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A node of this package, its log in ``<folder>/<name>.log``; interrupted at the end.

    Raises RuntimeError with the log's last line where it fails.
    """
    log = folder / f"{name}.log"
    command = [sys.executable, "-m", f"sysid_node.ros.{name}", *arguments]
    with log.open("wb") as file, started(command, file) as process:
        yield process
    if process.returncode:
        lines = log.read_text(encoding="utf-8").splitlines() or ["the log is empty"]
        raise RuntimeError(f"the {name} ended with code {process.returncode}: {lines[-1]}")


@contextlib.contextmanager
def started(command: Sequence[str], log: BinaryIO, number: int = signal.SIGINT) -> Iterator[subprocess.Popen[bytes]]:
    """A process that says everything to ``log``.

    The signal ``number`` ends it at the end of the context, and before a signal ends this process. While a signal is
    handled nothing is started any more: it would go on alone.
    """
    with contextlib.ExitStack() as stack:
        with indivisible():
            process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
            stack.callback(_end, process, number)
            stack.enter_context(on_interrupt(lambda: _end(process, number)))
        yield process


def _end(process: subprocess.Popen[bytes], number: int) -> None:
    """Send a process a signal, and kill it where it does not end."""
    process.send_signal(number)
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
