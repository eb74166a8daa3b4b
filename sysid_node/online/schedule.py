"""When estimates fall due: at a rate in the time of the data, the same live and in a replay.

At a rate of publication f the k-th estimate is that of the sample nearest k / f: the first whose time, with half the
interval since the sample before it, reaches k / f. Nearest, not first at or past it: where IMU and air data are sampled
together, stamps that jitter a little would otherwise put every estimate one sample late, and with it the wait for the
next air data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sysid_node.flight.record import Array


@dataclass
class Schedule:
    """What has fallen due so far."""

    rate: float  # Hz
    next: int = 1  # k of the next estimate
    previous: float | None = None  # s, time of the last sample


def due(schedule: Schedule, time: float) -> bool:
    """Whether an estimate falls due at the sample at ``time`` (s, increasing); at most one a sample does."""
    reach = time
    if schedule.previous is not None:
        reach += 0.5 * min(time - schedule.previous, 1.0 / schedule.rate)
    schedule.previous = time
    if reach < schedule.next / schedule.rate:
        return False
    while reach >= schedule.next / schedule.rate:
        schedule.next += 1
    return True


def due_times(time: Array, rate: float) -> Array:
    """Those of the samples' times (N,) s, increasing, at which ``due`` says so."""
    intervals = np.minimum(np.diff(time, prepend=time[:1]), 1.0 / rate)
    reach = np.maximum.accumulate(time + 0.5 * intervals)
    places = np.unique(np.searchsorted(reach, np.arange(1, int(reach[-1] * rate) + 2) / rate))
    return time[places[places < time.size]]
