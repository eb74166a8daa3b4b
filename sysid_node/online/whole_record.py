"""A whole record at once: the estimates that ``update`` with every sample gives, to the last bit, much faster."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.changes.detection import PIECE
from sysid_node.online.estimates.published import estimates_at
from sysid_node.online.frequency import fourier_transform, regression_signals
from sysid_node.online.segment_update import look_ahead, reach
from sysid_node.online.settings import Settings
from sysid_node.online.state import State
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]
CHUNK = 512  # samples whose signals are made at once
AT_ONCE = 48  # moments that are solved for at once: what they need stays in the processor's caches


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
    results = _Results(estimator.init(aircraft, settings))
    due = np.unique(np.searchsorted(time, publish_times, side="left"))
    for begin in range(0, time.size, CHUNK):
        end = min(begin + CHUNK, time.size)
        chunk = _prepare(results.state, time[begin:end], samples[begin:end])
        stops = due[(due >= begin) & (due < end)] - begin
        if results.state.renewed is None:
            # what is missing is told from moment to moment
            for first, stop in pairwise(dict.fromkeys([0, *(stops + 1).tolist(), end - begin])):
                _advance(results, chunk, first, stop, stops[stops + 1 == stop])
                results.finish()
        else:
            _advance(results, chunk, 0, end - begin, stops)
        if progress is not None:
            progress(float(time[end - 1]))
    results.finish()
    return results.estimates


class _Results:
    """Collects the moments at which estimates are wanted; those of one renewal are solved for at once."""

    def __init__(self, state: State) -> None:
        self.state = state
        self.estimates: list[Estimates] = []
        self._lines: list[Array] = []
        self._times: list[float] = []
        self._nows: list[float] = []

    def want(self, lines: Array, times: Sequence[float], nows: Sequence[float]) -> None:
        """The estimates at ``times`` (K,) s, as they stood ``nows`` (K,) s.

        ``lines`` (K, 2F + 1, W): the transform then.
        """
        if not len(lines):
            return
        self._lines.append(lines)
        self._times += times
        self._nows += nows
        if len(self._times) >= AT_ONCE:
            self.finish()

    def finish(self, state: State | None = None) -> None:
        """Solve for what is wanted so far, as the ``state`` stood then, if it is not what it was."""
        if self._lines:
            lines = np.concatenate(self._lines)
            self.estimates += estimates_at(state or self.state, lines, self._times, self._nows)
            self._lines, self._times, self._nows = [], [], []

    def renew(self) -> None:
        """Renew what is due to be; solve for what is wanted so far as it was before, where this changes anything."""
        if self.state.flow.active:
            self.finish()
        before = copy(self.state)
        estimator.renew_early(self.state)
        if self.state.renewed is not before.renewed:
            self.finish(before)


@dataclass(frozen=True)
class _Chunk:
    """Consecutive usable samples (n,), each with the interval that ends in it. Times in s."""

    given: Array  # (N,) of all samples given
    kept: NDArray[np.intp]  # (N + 1,) usable samples among the first of those given
    missing: NDArray[np.intp]  # (N,) what ``leave_out`` counts, -1 where a sample is usable or too early to count
    time: Array  # (n,)
    begins: Array  # (n,) start of the interval; NaN where none leads to the sample
    reach: Array  # (n,) see ``renewal.reach``
    values: Array  # (n, T) signals
    areas: Array  # (n, T), see ``transform``
    slants: Array  # (n, T)
    intervals: Array  # (n,) of the air data
    last: tuple[float, Array, tuple[float, ...]] | None


def _prepare(state: State, time: Array, samples: Array) -> _Chunk:
    """What ``update`` computes of each sample by itself, for many."""
    samples = flow_angle_filter.complete_many(state.flow, time, samples, state.model.settings.max_gap)
    usable, missing = _usable(state, time, samples)
    given, kept = time, np.concatenate([[0], np.cumsum(usable)])
    time, columns = time[usable], [np.ascontiguousarray(column) for column in samples[usable].T]
    thrust = estimator.THRUST
    columns[thrust] = np.where(np.abs(columns[thrust]) < estimator.LIMIT, columns[thrust], 0.0)
    if not time.size:
        empty = np.empty((0, state.model.layout.transformed))
        return _Chunk(given, kept, missing, time, time, time, empty, empty, empty, time, state.previous)
    rows, angles = regression_signals.array_signals(state.model.aircraft)(columns)
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
    last = (float(time[-1]), values[-1], tuple(float(m[-1]) for m in motion))
    intervals = columns[estimator.INTERVAL]
    return _Chunk(given, kept, missing, time, begins, reach(time, steps), values, areas, slants, intervals, last)


def _usable(state: State, time: Array, samples: Array) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """(N,) which samples ``update`` takes in, and which column the others lack."""
    if np.isnan(state.begin) and time.size:
        state.begin = estimator.first_counted(float(time[0]), state.model.settings)
    possible = (samples > np.array(state.model.lowest)) & (samples < estimator.LIMIT)
    late = time >= state.begin
    if not state.thrust_known:
        powered = possible[:, estimator.THRUST].copy()
        possible[:, estimator.THRUST] = True
        others = np.flatnonzero(late & possible.all(axis=1))
        if state.thrust_known is None and others.size:
            first = int(others[0])
            state.thrust_known = bool(powered[first])
            if state.thrust_known:
                possible[first:, estimator.THRUST] = powered[first:]
    complete = possible.all(axis=1)
    missing = np.where(late & ~complete, np.argmin(possible, axis=1), -1)
    usable = late & complete
    hasty = _hasty(state, time, np.flatnonzero(usable))
    missing[hasty] = samples.shape[1]
    usable[hasty] = False
    return usable, missing


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


def _advance(results: _Results, chunk: _Chunk, first: int, stop: int, wanted: NDArray[np.intp]) -> None:
    """Take in the given samples first..stop (exclusive); estimates are ``wanted`` after some of them."""
    state = results.state
    for column in chunk.missing[first:stop][chunk.missing[first:stop] >= 0].tolist():
        estimator.leave_out(state, column)
    stops = deque(zip(chunk.kept[wanted + 1].tolist(), chunk.given[wanted].tolist(), strict=True))
    begin, end = int(chunk.kept[first]), int(chunk.kept[stop])
    while begin < end:
        _want(results, stops, begin)
        begin = _integrate(results, chunk, begin, end, stops)
    _want(results, stops, end)
    if end == chunk.time.size:
        state.previous = chunk.last


def _want(results: _Results, stops: deque[tuple[int, float]], count: int) -> None:
    """The estimates that are wanted after ``count`` usable samples, all of which have been taken in."""
    running = results.state.transform
    for _, now in _popped(stops, count):
        results.want(fourier_transform.current(running)[None], [running.last], [now])


def _popped(stops: deque[tuple[int, float]], count: int) -> list[tuple[int, float]]:
    """The ``stops`` up to ``count`` usable samples."""
    found = []
    while stops and stops[0][0] <= count:
        found.append(stops.popleft())
    return found


def _integrate(results: _Results, chunk: _Chunk, begin: int, end: int, stops: deque[tuple[int, float]]) -> int:
    """Take in usable samples from ``begin`` to what ends the stretch, at most ``end`` (exclusive), and return that."""
    state = results.state
    if np.isnan(chunk.begins[begin]) or reach(state.transform.last, state.step) >= state.renew_at:
        results.renew()
    if np.isnan(chunk.begins[begin]):
        results.finish()
        estimator.interrupt(state, float(chunk.time[begin]))
        return begin + 1
    gaps = np.flatnonzero(np.isnan(chunk.begins[begin:end]))
    return _take_pieces(
        results, chunk, begin, _pieces(state, chunk, begin, begin + int(gaps[0]) if gaps.size else end), stops
    )


def _pieces(state: State, chunk: _Chunk, begin: int, end: int) -> list[int]:
    """Where pieces of data end between the usable samples ``begin`` and ``end``: up to that, or the segment's end."""
    ends, at, renew_at = [], begin, state.renew_at
    while at < end:
        far = np.flatnonzero(chunk.reach[at:end] >= renew_at)
        at = at + int(far[0]) + 1 if far.size else end
        ends.append(at)
        if chunk.reach[at - 1] - state.segment_start >= state.model.segment_time:
            break
        renew_at = float(chunk.time[at - 1]) + PIECE
    return ends


def _take_pieces(results: _Results, chunk: _Chunk, begin: int, ends: list[int], stops: deque[tuple[int, float]]) -> int:
    """Take in usable samples from ``begin`` to the last of the ``ends``, which are pieces', all transformed at once.

    What is renewed between them sees the transform as it was by then. Where that changes it, for all is learned anew,
    the rest is left for another time: returns up to where samples are taken in.
    """
    state, running, part = results.state, results.state.transform, slice(begin, ends[-1])
    places = sorted([*(count for count, _ in stops if count <= ends[-1]), *ends])
    moved = chunk.begins[part], chunk.time[part], chunk.areas[part], chunk.slants[part]
    lines = fourier_transform.add_many(running, *moved, [place - begin for place in places])
    times, rows = chunk.time[np.array(ends) - 1].tolist(), [bisect_right(places, end) - 1 for end in ends]
    for piece, (first, stop) in enumerate(pairwise([begin, *ends])):
        wanted, row = _popped(stops, stop), rows[piece]
        moments = [float(chunk.time[count - 1]) for count, _ in wanted]
        results.want(lines[row - len(wanted) : row], moments, [now for _, now in wanted])
        _count(state, chunk, slice(first, stop))
        if stop < ends[-1]:
            state.transform = fourier_transform.as_it_was(running, times[piece], lines[row])
            look_ahead(state, times[piece:-1], [lines[k] for k in rows[piece:-1]])
            was = state.transform.done
            results.renew()
            if state.transform.done is not was:
                return stop
    state.transform = running
    return ends[-1]


def _count(state: State, chunk: _Chunk, part: slice) -> None:
    """What ``update`` counts of each of some consecutive samples."""
    state.step = float(chunk.time[part.stop - 1] - chunk.begins[part.stop - 1])
    state.samples += part.stop - part.start
    state.recent.append(chunk.values[part])
    # one after the other, as ``update`` adds them
    state.intervals = float(np.cumsum(np.append(state.intervals, chunk.intervals[part]))[-1])
