"""When estimates fall due: at a rate in the time of the data, the same live and in a replay.

At a rate of publication f the k-th estimate is that of the sample nearest k / f: the first whose time, with half the
interval since the sample before it, reaches k / f. Nearest, not first at or past it: where IMU and air data are sampled
together, stamps that jitter a little would otherwise put every estimate one sample late.

A sample is complete when the air data and positions that it lies before have come, which may be several IMU messages
later; the last of the samples that are complete then is known as soon as the first. So a sample leaves the estimate to
a fresher one where that comes before the next falls due. Samples are fresh that wait hardly longer than those that
waited least lately; how long that is depends on how the stamps of the topics lie to each other.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

SPARE = 0.25  # IMU intervals that a fresh sample may wait longer than those of late
RUNS = 8  # runs of ever shorter waits, each ended by a message, in which is looked for what is fresh


@dataclass
class Schedule:
    """What has fallen due so far."""

    rate: float  # Hz
    next: int = 1  # k of the next estimate
    previous: float | None = None  # s, time of the last sample
    wait: float = 0.0  # s, of the last sample
    shortest: deque[float] = field(default_factory=lambda: deque(maxlen=RUNS))  # s, waits that ended runs


def due(schedule: Schedule, time: float, wait: float) -> bool:
    """Whether an estimate falls due at the sample at ``time`` (s, increasing); at most one a sample does.

    ``wait`` (s): from the sample to the last of the messages that it lies before.
    """
    interval = 0.0 if schedule.previous is None else time - schedule.previous
    if wait >= schedule.wait and schedule.previous is not None:
        schedule.shortest.append(schedule.wait)
    schedule.previous, schedule.wait, rate = time, wait, schedule.rate
    reach = time + 0.5 * min(interval, 1.0 / rate)
    if reach < schedule.next / rate:
        return False
    fresh = wait <= max(schedule.shortest, default=0.0) + SPARE * interval
    if not fresh and reach + wait < (schedule.next + 1) / rate:
        return False
    while reach >= schedule.next / rate:
        schedule.next += 1
    return True
