"""Hands flights to Dask's workers and takes what comes back; memory does not grow with the number of flights."""

from __future__ import annotations

import contextlib
import math
import queue
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import Any, Generic, TypeVar

from distributed import Client, Future, KilledWorker
from distributed.client import FutureCancelledError

from sysid_node.errors import InputError
from sysid_node.fleet.engine.guarded import BEGUN, Returned, guarded

T = TypeVar("T")
R = TypeVar("R")

#: Jobs that wait at a scheduler of our own for a worker to be free, so that none waits for the command. Another
#: scheduler may assign a waiting job to a worker that is busy, and blame it where that worker ends.
_WAITING = 2
_LOOK = 0.5  # s between looks at the scheduler and at the workers, and between counts of these


class SchedulerLostError(InputError):
    """The scheduler does not answer any more; what had come back is kept."""


@dataclass(frozen=True)
class Limits:
    """What a flight may take: ``seconds`` an attempt, and ``retries`` after an attempt whose process ended."""

    seconds: float = 3600.0
    retries: int = 1


@dataclass(frozen=True)
class Job(Generic[T]):
    """A flight to be worked on: its ``name``, and what the work is given."""

    name: str
    given: T


@dataclass
class _Attempt(Generic[T]):
    """A job that is handed out, for the ``number``-th time."""

    job: Job[T]
    number: int
    future: Future
    begun: float = math.nan  # s of the monotonic clock, when its worker began with it


def run(
    client: Client,
    jobs: Iterable[Job[T]],
    work: Callable[[T], R],
    done: Callable[[Job[T], Returned[R]], None],
    limits: Limits | None = None,
    revive: Callable[[], None] = lambda: None,
) -> None:
    """Call ``work`` with every job on the client's workers, and ``done`` here with each of what they return.

    The jobs are taken as workers come free: what is in memory does not depend on how many there are. A job whose
    worker's process ends (killed, out of memory, crashed, over its time) is handed out again ``limits.retries`` times
    and then comes back refused. ``revive`` is called now and then while nothing comes back. Raises SchedulerLostError.
    """
    engine = _Engine(client, work, limits or Limits(), revive)
    with engine.listening():
        for job in jobs:
            engine.start(job, 1)
            while len(engine.attempts) >= engine.room():
                engine.take(done)
        while engine.attempts:
            engine.take(done)


class _Engine(Generic[T, R]):
    """The attempts that are handed out."""

    def __init__(self, client: Client, work: Callable[[T], R], limits: Limits, revive: Callable[[], None]) -> None:
        self.client, self.work, self.limits, self.revive = client, work, limits, revive
        self.attempts: dict[str, _Attempt[T]] = {}
        self._finished: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._numbers = count()
        self._threads, self._counted = 0, -math.inf  # of all workers, and when they were counted
        self._prefix = f"sysid-flight-{time.time_ns():x}"

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """A context in which workers' announcements are heard, and at whose end nothing is left with the scheduler."""
        self.client.subscribe_topic(BEGUN, self._heard)
        try:
            yield
        finally:
            with contextlib.suppress(Exception):  # the scheduler may be gone
                for attempt in self.attempts.values():
                    attempt.future.cancel()
                self.client.unsubscribe_topic(BEGUN)

    def room(self) -> int:
        """How many jobs are handed out at a time."""
        now = time.monotonic()
        if now - self._counted > _LOOK:
            self._threads = sum(self.client.nthreads().values()) if self._alive() else 0
            self._counted = now
        return self._threads + _WAITING if self.client.cluster is not None else max(self._threads, 1)

    def start(self, job: Job[T], number: int) -> None:
        """Hand out a job, for the ``number``-th time."""
        key = f"{self._prefix}-{next(self._numbers)}"
        future = self.client.submit(guarded, self.work, key, job.given, self.limits.seconds, key=key, pure=False)
        self.attempts[key] = _Attempt(job, number, future)
        future.add_done_callback(lambda _: self._finished.put(key))

    def take(self, done: Callable[[Job[T], Returned[R]], None]) -> None:
        """Wait until one job has come back, and pass it on or hand it out again."""
        while True:
            try:
                key = self._finished.get(timeout=_LOOK)
                break
            except queue.Empty:
                self._require_scheduler()
                self.revive()
        attempt = self.attempts[key]
        finished = attempt.future.status == "finished"
        returned = self._returned(attempt)
        del self.attempts[key]
        attempt.future.release()
        left = attempt.number <= self.limits.retries
        if returned is None and finished:  # its worker ended, by another job, before the result was fetched
            self.start(attempt.job, attempt.number)
        elif left and (returned is None or returned.again):
            self.start(attempt.job, attempt.number + 1)
        else:
            done(attempt.job, returned or self._lost(attempt))

    def _returned(self, attempt: _Attempt[T]) -> Returned[R] | None:
        """What came back; None where the worker's process ended."""
        try:
            found: Returned[R] = attempt.future.result()
            return found
        except (KilledWorker, FutureCancelledError):
            self._require_scheduler()
            return None
        except Exception as error:  # what a worker returned cannot be unpacked, say: one line
            words = " ".join(f"failed: {type(error).__name__}: {error}".split())
            return Returned(None, words, True, False, (), 0.0, 0.0)

    def _lost(self, attempt: _Attempt[T]) -> Returned[R]:
        """The refusal of a job whose process ended in every attempt."""
        took = time.monotonic() - attempt.begun
        if took >= self.limits.seconds:
            words = f"took longer than {self.limits.seconds:g} s; give more time by --time-limit, or leave it out"
        else:
            words = (
                f"its process ended {attempt.number} times without a result (out of memory, killed, or a library "
                "crashed); give a worker more memory by --memory, or run it alone to see more"
            )
        return Returned(None, words, True, False, (), 0.0 if math.isnan(took) else took, 0.0)

    def _heard(self, event: tuple[float, Any]) -> None:
        """Note that a worker has begun with a job; called by Dask in another thread."""
        attempt = self.attempts.get(event[1].get("job", ""))
        if attempt is not None:
            attempt.begun = time.monotonic()

    def _alive(self) -> bool:
        return str(self.client.status) == "running"

    def _require_scheduler(self) -> None:
        if not self._alive():
            raise SchedulerLostError(
                "the scheduler does not answer any more; what had come back is kept: start the command again"
            )
