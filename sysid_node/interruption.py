"""How a command ends on SIGINT and SIGTERM: at once, in one line, with nothing half-written.

Python raises KeyboardInterrupt in the main thread, between two of its instructions. Where that is inside a callback of
a compiled library the exception is lost, and where the library's threads still run while Python shuts down the process
crashes. Here the signal wakes a thread instead, which undoes what is unfinished and ends the process.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_actions: dict[object, Callable[[], None]] = {}
_indivisible = threading.RLock()


@contextlib.contextmanager
def on_interrupt(action: Callable[[], None]) -> Iterator[None]:
    """A context in which ``action`` is called before a signal ends the process; the latest is called first."""
    key = object()
    _actions[key] = action
    try:
        yield
    finally:
        _actions.pop(key, None)


@contextlib.contextmanager
def indivisible() -> Iterator[None]:
    """A context that a signal does not interrupt: the process ends after it. It must be short."""
    with _indivisible:
        yield


def end_on_signals(say: Callable[[int], None]) -> None:
    """From now on SIGINT and SIGTERM end the process with 128 + the signal's number, after ``say`` of that number.

    A signal that was ignored when the process started stays ignored, as ``nohup`` wants it.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    handled = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    for number in handled:
        signal.signal(number, lambda *_: None)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=_end, args=(reader, frozenset(handled), say), name="signals", daemon=True).start()


def _end(reader: int, handled: frozenset[int], say: Callable[[int], None]) -> None:
    number = 0
    while number not in handled:
        number = os.read(reader, 1)[0]
    with _indivisible:
        for action in reversed(list(_actions.values())):
            with contextlib.suppress(Exception):
                action()
        with contextlib.suppress(Exception):
            say(number)
            sys.stderr.flush()
        os._exit(128 + number)
