"""One flight on a worker: its work under a time limit, with its refusals and its warnings as data.

A thread cannot be stopped from outside, and compiled code does not listen. A flight that takes longer than its limit
therefore ends its worker's process, by a watchdog of the interpreter that needs no lock of Python's
(``faulthandler.dump_traceback_later``). Dask's nanny starts another process.
"""

from __future__ import annotations

import faulthandler
import os
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from distributed import get_worker

from sysid_node.errors import InputError, InputWarning

T = TypeVar("T")
R = TypeVar("R")

#: Dask's topic on which workers say that they begin with a flight.
BEGUN = "sysid-fleet-begun"


@dataclass(frozen=True)
class Returned(Generic[R]):
    """What a worker sends back: the ``result``, or None and the ``refusal``, one line.

    ``broken``: the refusal is no fault of the flight's that is known, so that a later start of the command tries it
    again; ``again``: it may be of the moment, such as a file server that does not answer, so that it is tried at once.
    ``remarks`` are warnings about the flight, ``seconds`` what it took, and ``processor_seconds`` the processor's time.
    """

    result: R | None
    refusal: str
    broken: bool
    again: bool
    remarks: tuple[str, ...]
    seconds: float
    processor_seconds: float


def guarded(work: Callable[[T], R], job: str, given: T, limit: float) -> Returned[R]:
    """``work(given)`` under a time limit of ``limit`` s; its exceptions become refusals. ``job`` names it."""
    get_worker().log_event(BEGUN, {"job": job})
    start, used = time.monotonic(), time.process_time()
    result, refusal, broken, again = None, "", False, False
    with _time_limit(limit), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", InputWarning)
        try:
            result = work(given)
        except InputError as error:
            refusal = str(error)
        except Exception as error:  # whatever else goes wrong is one line, as in every command
            refusal, broken = f"failed: {type(error).__name__}: {error}", True
            again = isinstance(error, OSError | MemoryError)
    remarks = tuple(dict.fromkeys(" ".join(str(one.message).split()) for one in caught))
    seconds, processor = time.monotonic() - start, time.process_time() - used
    return Returned(result, " ".join(refusal.split()), broken, again, remarks, seconds, processor)


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    with Path(os.devnull).open("w") as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
