"""Dask's workers: started here, one thread a process, or those of a scheduler that runs already."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import dask
from distributed import Client, LocalCluster, WorkerPlugin

from sysid_node.errors import InputError

#: A flight whose process ends is handed out again by our own count, not by Dask's. Memory is bounded by ending the
#: process: a worker that spills or pauses at a share of its limit would wait for memory that the libraries keep.
_SETTINGS: dict[str, Any] = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
    "distributed.worker.daemon": True,
    # what Dask remembers of tasks that are over is kept short: it would grow with the number of flights
    "distributed.admin.system-monitor.log-length": 60,
    "distributed.admin.low-level-log-length": 200,
    "distributed.admin.log-length": 200,
    "distributed.nanny.pre-spawn-environ.OMP_NUM_THREADS": 1,
    "distributed.nanny.pre-spawn-environ.MKL_NUM_THREADS": 1,
    "distributed.nanny.pre-spawn-environ.OPENBLAS_NUM_THREADS": 1,
}

#: Seconds in which a scheduler must answer.
_ANSWER = 15.0


class IgnoreInterrupts(WorkerPlugin):  # type: ignore[misc]  # Dask has no type hints
    """Lets a worker of this machine ignore Ctrl-C, which the terminal sends to all: the command ends its workers."""

    def setup(self, worker: object) -> None:
        """Called by Dask in the worker's main thread."""
        with contextlib.suppress(ValueError):  # not the main thread
            signal.signal(signal.SIGINT, signal.SIG_IGN)


class Workers(NamedTuple):
    """A client of the workers' scheduler, and a function that starts those anew that have gone and did not return."""

    client: Client
    revive: Callable[[], None]


def check_memory(memory: str | None) -> None:
    """Raise InputError where the memory of a worker is given and is no size."""
    if memory is None:
        return
    try:
        dask.utils.parse_bytes(memory)
    except ValueError:
        raise InputError(f"--memory {memory!r}: expected a size, e.g. 2GB") from None


@contextlib.contextmanager
def local_workers(count: int, memory: str | None = None) -> Iterator[Workers]:
    """``count`` worker processes on this machine, each bounded to ``memory`` (as "2GB"; None: its share of all).

    Raises InputError where the memory is no size.
    """
    check_memory(memory)
    _quiet()
    with dask.config.set(_SETTINGS), _silent_tracker():
        cluster = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            memory_limit="auto" if memory is None else memory,
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        )
        try:
            with Client(cluster) as client:
                client.register_plugin(IgnoreInterrupts())
                yield Workers(client, lambda: cluster.scale(count))
        finally:
            with contextlib.suppress(TimeoutError):  # a worker that is being started anew
                cluster.close(timeout=_ANSWER)


@contextlib.contextmanager
def connected(address: str, answer_within_s: float = _ANSWER) -> Iterator[Workers]:
    """The workers of the scheduler at ``address``. Raises InputError where none answers within so many seconds."""
    _quiet()
    try:
        client = Client(address, timeout=answer_within_s)
    except (OSError, ValueError, TimeoutError) as error:
        words = " ".join(str(error).split())[:200]
        raise InputError(f"--scheduler {address}: no scheduler answers ({words}); is it dask scheduler's?") from error
    try:
        if not client.scheduler_info(n_workers=-1)["workers"]:
            raise InputError(f"--scheduler {address}: it has no workers; start some: dask worker {address}")
        yield Workers(client, lambda: None)
    finally:
        client.close(timeout=5.0)


@contextlib.contextmanager
def _silent_tracker() -> Iterator[None]:
    """A context whose processes do not warn of semaphores that Python removes after a command that was ended."""
    before = os.environ.get("PYTHONWARNINGS")
    silent = "ignore::UserWarning:multiprocessing.resource_tracker"
    os.environ["PYTHONWARNINGS"] = silent if before is None else f"{before},{silent}"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = before


def _quiet() -> None:
    """Let Dask's loggers be silent: what concerns the user comes as one line of the command."""
    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
