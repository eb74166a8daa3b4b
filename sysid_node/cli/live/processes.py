"""Nodes of this package as processes."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path


@contextlib.contextmanager
def node_process(name: str, arguments: Sequence[str], folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A node of this package, its log in ``<folder>/<name>.log``; interrupted at the end.

    Raises RuntimeError with the log's last line where it fails.
    """
    log = folder / f"{name}.log"
    command = [sys.executable, "-m", f"sysid_node.ros.{name}", *arguments]
    with log.open("wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT)
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()
    if process.returncode:
        lines = log.read_text(encoding="utf-8").splitlines() or ["the log is empty"]
        raise RuntimeError(f"the {name} ended with code {process.returncode}: {lines[-1]}")
