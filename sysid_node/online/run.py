"""A whole record at once: the estimates that ``update`` with every sample gives, to the last bit, much faster."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator, signals, transform
from sysid_node.online.estimates import estimate
from sysid_node.online.renewal import renew
from sysid_node.online.settings import Settings
from sysid_node.online.state import State
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]
CHUNK = 512  # samples whose weights are held at once


def run(
    aircraft: Aircraft,
    settings: Settings,
    time: Array,
    samples: Array,
    publish_times: Array,
    progress: Callable[[float], None] | None = None,
) -> list[Estimates]:
    """Estimates as they stand after the first sample at or past each of ``publish_times`` (K,) s, at most one a sample.

    ``time`` (N,) s, increasing; ``samples`` (N, M) as ``estimator.update`` takes them; ``progress`` hears the time (s).
    """
    state = estimator.init(aircraft, settings)
    results: list[Estimates] = []
    due = np.unique(np.searchsorted(time, publish_times, side="left"))
    for begin in range(0, time.size, CHUNK):
        end = min(begin + CHUNK, time.size)
        stops = due[(due >= begin) & (due < end)] - begin
        chunk = _prepare(state, time[begin:end], samples[begin:end])
        done = 0
        for stop in (stops + 1).tolist():
            _advance(state, chunk, done, stop)
            results.append(estimate(state, float(time[begin + stop - 1])))
            done = stop
        _advance(state, chunk, done, end - begin)
        if progress is not None:
            progress(float(time[end - 1]))
    return results


@dataclass(frozen=True)
class _Chunk:
    """Consecutive usable samples (n,), each with the interval that ends in it. Times in s."""

    kept: NDArray[np.intp]  # (N + 1,) usable samples among the first of those given
    missing: NDArray[np.intp]  # (N,) what ``leave_out`` counts, -1 where a sample is usable or too early to count
    powerless: NDArray[np.bool_]  # (N,) samples without a thrust
    time: Array  # (n,)
    begins: Array  # (n,) start of the interval; NaN where none leads to the sample
    areas: Array  # (n, T), see ``transform``
    slants: Array  # (n, T)
    kernels: Array  # (n, 2, rows)
    intervals: Array  # (n,) of the air data
    last: tuple[float, Array, tuple[float, ...]] | None


def _prepare(state: State, time: Array, samples: Array) -> _Chunk:
    """What ``update`` computes of each sample by itself, for many."""
    usable, missing, powerless = _usable(state, time, samples)
    kept = np.concatenate([[0], np.cumsum(usable)])
    time, columns = time[usable], [np.ascontiguousarray(column) for column in samples[usable].T]
    thrust = estimator.THRUST
    columns[thrust] = np.where(np.abs(columns[thrust]) < estimator.LIMIT, columns[thrust], 0.0)
    grid = state.transform.grid
    if not time.size:
        empty = np.empty((0, state.model.layout.transformed))
        return _Chunk(
            kept, missing, powerless, time, time, empty, empty, np.empty((0, 2, grid.rows)), time, state.previous
        )
    rows, angles = signals.array_signals(state.model.aircraft)(columns)
    rows.insert(estimator.DRIFT, time)
    values = np.stack(rows, axis=1)
    motion = [*columns[3:6], *angles]
    begins = np.concatenate([[np.nan], time[:-1]])
    before, motion_before = np.vstack([values[:1], values[:-1]]), [np.concatenate([m[:1], m[:-1]]) for m in motion]
    if state.previous is not None:
        begins[0], before[0] = state.previous[0], state.previous[1]
        for column, value in zip(motion_before, state.previous[2], strict=True):
            column[0] = value
    begins[~(time - begins <= state.model.settings.max_gap)] = np.nan
    steps = time - begins
    gain = np.stack(state.model.momentum(motion_before, motion), axis=1)
    areas, slants = estimator.over_interval(state.model.layout, steps[:, None], before, values, gain)
    kernels = transform.weights_of_many(grid, begins + 0.5 * steps, steps)
    last = (float(time[-1]), values[-1], tuple(float(m[-1]) for m in motion))
    return _Chunk(kept, missing, powerless, time, begins, areas, slants, kernels, columns[estimator.INTERVAL], last)


def _usable(state: State, time: Array, samples: Array) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.bool_]]:
    """(N,) which samples ``update`` takes in, which column the others lack, and which have no thrust."""
    if np.isnan(state.begin) and time.size:
        state.begin = float(time[0]) + state.model.settings.settle_time
    possible = (samples > np.array(state.model.lowest)) & (samples < estimator.LIMIT)
    late = time >= state.begin
    powerless = late & ~possible[:, estimator.THRUST]
    possible[:, estimator.THRUST] = True
    complete = possible.all(axis=1)
    missing = np.where(late & ~complete, np.argmin(possible, axis=1), -1)
    usable = late & complete
    hasty = _hasty(state, time, np.flatnonzero(usable))
    missing[hasty] = samples.shape[1]
    usable[hasty] = False
    return usable, missing, powerless


def _hasty(state: State, time: Array, rows: NDArray[np.intp]) -> list[int]:
    """Those of the ``rows`` that do not come after the last usable sample before them."""
    last = state.previous[0] if state.previous is not None else -math.inf
    if not np.any(np.diff(time[rows], prepend=last) < estimator.SHORTEST):
        return []
    hasty = []
    for row in rows.tolist():
        if time[row] - last < estimator.SHORTEST:
            hasty.append(row)
        else:
            last = float(time[row])
    return hasty


def _advance(state: State, chunk: _Chunk, first: int, stop: int) -> None:
    """Take in the given samples first..stop (exclusive)."""
    for column in chunk.missing[first:stop][chunk.missing[first:stop] >= 0].tolist():
        estimator.leave_out(state, column)
    if chunk.powerless[first:stop].any():
        state.thrust_known = False
    _integrate(state, chunk, int(chunk.kept[first]), int(chunk.kept[stop]))


def _integrate(state: State, chunk: _Chunk, begin: int, end: int) -> None:
    """Take in the usable samples begin..end (exclusive)."""
    while begin < end:
        if np.isnan(chunk.begins[begin]):
            estimator.interrupt(state, float(chunk.time[begin]))
            begin += 1
            continue
        # up to and including the sample that renews, short of the next gap
        stop = min(int(np.searchsorted(chunk.time[begin:end], state.renew_at, side="left")) + 1 + begin, end)
        gaps = np.flatnonzero(np.isnan(chunk.begins[begin:stop]))
        stop = begin + int(gaps[0]) if gaps.size else stop
        part = slice(begin, stop)
        intervals = chunk.begins[part], chunk.time[part]
        transform.add_many(state.transform, chunk.kernels[part], *intervals, chunk.areas[part], chunk.slants[part])
        state.samples += stop - begin
        # one after the other, as ``update`` adds them
        state.intervals = float(np.cumsum(np.append(state.intervals, chunk.intervals[part]))[-1])
        if state.transform.last >= state.renew_at:
            renew(state)
        begin = stop
    if end == chunk.time.size:
        state.previous = chunk.last
