"""Work for the engine's tests, which workers import by name: quick, and with the faults that flights may have."""

from __future__ import annotations

import os
import signal
import time
import warnings
from pathlib import Path

from sysid_node.errors import InputError, InputWarning


def double(number: int) -> int:
    """Twice the number."""
    return 2 * number


def moody(task: tuple[str, str]) -> str:
    """Does what the first word says; the second is a folder to leave marks in."""
    word, folder = task
    with Path(folder, word).open("a") as file:
        file.write("x")
    attempts = Path(folder, word).stat().st_size
    if word == "refused":
        raise InputError(f"{word}: no airspeed in it; record it too")
    if word == "broken":
        raise ZeroDivisionError("a fault\nof the program")
    if word == "once killed" and attempts == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    if word == "always killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if word == "too slow":
        time.sleep(60.0)
    if word == "warns":
        warnings.warn("the flight is short", InputWarning, stacklevel=2)
    return word.upper()


def slowly(task: tuple[float, str]) -> int:
    """Sleeps as long as it is told, then leaves a mark and returns its process."""
    seconds, mark = task
    time.sleep(seconds)
    with Path(mark).open("a") as file:
        file.write("x")
    return os.getpid()
