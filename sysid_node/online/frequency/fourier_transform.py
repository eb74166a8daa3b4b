"""Recursive finite Fourier transform of irregularly sampled signals, exact for piecewise-linear signals.

    X(omega) = integral of x(t) exp(-j omega t) exp(-(T - t) / 2 tau) dt

Morelli, "Real-time parameter estimation in the frequency domain", J. Guidance 23(5), 2000, eqs. 10 to 13, with three
changes. The samples' own times are used: between two samples the signal is the straight line, given by its area
h (x_0 + x_1) / 2 and its slant h^2 (x_1 - x_0) / 2 over the interval of length h, so that jitter, lost and late samples
do not bias it. A rate's derivative enters as its increment over the interval, which is the derivative's area: summed by
parts this is j omega X plus the boundary terms of the finite transform, without differentiating anything. Phases come
from absolute time, so nothing drifts.

Samples are collected in blocks that are short against the highest line's period. Over a block about its middle t_b

    integral of x(t) exp(-j omega t) dt = exp(-j omega t_b) sum over m of (-j omega)^m / m! mu_m,
    mu_m = integral of x(t) (t - t_b)^m dt

and a dozen moments mu_m are right to 1e-11 (the expansion of fast multipole methods: Greengard & Rokhlin, J. Comput.
Phys. 73, 1987). So waves are computed once a block, not once a sample. An interval that is too long for that is a block
of its own, with the transform of a straight line about its middle t_m in closed form,

    exp(-j omega t_m) (area sinc(phi) - j slant s(phi) / h),
    phi = omega h / 2,  s = (sin phi - phi cos phi) / phi^2.

The transform at any sample is the sum of the finished blocks and the unfinished one, which is one matrix product with
room for all of its samples, so the per-sample and the vectorised path give the same bits.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BLOCK = 16  # intervals in a block at most
MOMENTS = 12
_SPAN = 1.25  # rad, by which the highest line's phase turns in a block at most: 0.625^12 / 12! is 7e-12
_LANES = 8  # vectors are padded to whole SIMD registers: a value's bits then do not depend on its place
_PORTION = 384  # intervals that are taken in at once: what they need stays in the processor's caches


@dataclass
class Lines:
    """The frequency lines, padded to P, and what a block's waves need of them. R = 2F + 1 rows.

    Rows are the real parts, the imaginary parts, and the integral (zero frequency).
    """

    omega: Array  # (F,) rad/s
    padded: Array = field(init=False)  # (P,) rad/s: padded to whole registers
    half: float = field(init=False)  # s: half of a block's length
    span: float = field(init=False)  # s: a block's length
    scale: float = field(init=False)  # 1/s: one over its half
    waves: NDArray[np.intp] = field(init=False)  # (M, R) where in cos, sin and one each moment's wave is
    factors: Array = field(init=False)  # (M, R) by which it counts, with its sign

    def __post_init__(self) -> None:
        F, P = self.omega.size, -(-self.omega.size // _LANES) * _LANES
        self.padded = np.ones(P)
        self.padded[:F] = self.omega
        self.half = 0.5 * _SPAN / float(self.omega[-1])
        self.span, self.scale = 2.0 * self.half, 1.0 / self.half
        m = np.arange(MOMENTS)[:, None]
        # exp(-j theta) (-j)^m has the parts cos(theta + m pi / 2) and cos(theta + (m + 1) pi / 2)
        quarter = np.hstack([np.repeat(m, F, axis=1), np.repeat(m + 1, F, axis=1)]) % 4
        line = np.tile(np.arange(F), (MOMENTS, 2))
        size = np.cumprod(np.vstack([np.ones(2 * F), np.tile(self.omega * self.half, 2) / m[1:]]), axis=0)
        self.waves = np.hstack([line + P * (quarter % 2), np.full((MOMENTS, 1), 2 * P)])
        self.factors = np.hstack([np.where((quarter == 1) | (quarter == 2), -size, size), m == 0])

    @property
    def rows(self) -> int:
        """Number of rows R."""
        return 2 * self.count + 1

    @property
    def count(self) -> int:
        """Number of lines F."""
        return int(self.omega.size)


def lines(start_hz: float, step_hz: float, stop_hz: float) -> Lines:
    """Lines from start to stop (Hz), both included where the step meets them."""
    count = math.floor((stop_hz - start_hz) / step_hz + 1e-9) + 1
    omega = 2.0 * math.pi * (start_hz + step_hz * np.arange(count, dtype=np.float64))
    return Lines(omega)


def basis(grid: Lines, begins: Array) -> Array:
    """(..., M, R) what each moment brings to each row, in blocks that begin at (...) s.

    Moments are taken about the blocks' middles, in units of their halves.
    """
    phase, P = (begins + grid.half)[..., None] * grid.padded, grid.padded.size
    waves = np.ones((*phase.shape[:-1], 2 * P + 1))
    waves[..., :P], waves[..., P : 2 * P] = np.cos(phase), np.sin(phase)
    found: Array = waves.take(grid.waves, axis=-1)
    found *= grid.factors
    return found


def exact(grid: Lines, begin: float, end: float) -> Array:
    """(M, R) what the area and the slant of an interval (s) of any length bring to each row: the first two of these."""
    step = end - begin
    phi = 0.5 * step * grid.omega
    wave = np.exp(-1j * grid.omega * (begin + 0.5 * step))
    area, slant = wave * (np.sin(phi) / phi), -1j * wave * (np.sin(phi) - phi * np.cos(phi)) / (phi * phi * step)
    found = np.zeros((MOMENTS, grid.rows))
    found[:2, : grid.count], found[:2, grid.count : -1] = (area.real, slant.real), (area.imag, slant.imag)
    found[0, -1] = 1.0
    return found


_PLACES = np.arange(BLOCK)
#: The moments of such an interval are the area and the slant themselves.
_ITSELF = np.eye(2, MOMENTS)
#: Ratios of x^k / k to x^(k-1) / (k-1), over x.
_RATIOS = np.maximum(np.arange(MOMENTS + 1.0), 1.0) / np.arange(1.0, MOMENTS + 2.0)


def primitives(place: Any) -> Any:
    """(..., M + 1) x^k / k of places x (..., 1), the integrals of x^(k-1) up to there, k from 1."""
    return np.multiply.accumulate(place * _RATIOS, axis=-1)


_FROM = primitives(-1.0)


def weigh(before: Array, after: Array, left: Any, right: Any, step: Any, out: Array) -> None:
    """Moments of an interval's area and slant into ``out`` (..., 2, M).

    ``left`` and ``right`` (..., 1): its ends, from the block's middle in units of its half; ``before`` and ``after``:
    their ``primitives``; ``step`` (..., 1) in s.
    """
    integrals, width = after - before, right - left
    lower, even, odd = integrals[..., :-1], out[..., 0, :], out[..., 1, :]
    np.multiply(lower, 1.0 / width, out=even)
    np.multiply(lower, -0.5 * (right + left), out=odd)
    odd += integrals[..., 1:]
    odd *= 2.0 / (width * width * step)


@dataclass
class Transform:
    """Running transform: the finished blocks and the one being filled."""

    grid: Lines
    width: int  # signals
    memory: float  # s: tau of the energy's decay, inf = none
    done: Array  # (R, width + room) decayed to ``begin``
    kernels: Array  # (BLOCK, 2, M) moments of areas and slants in the unfinished block, zero behind them
    values: Array  # (BLOCK, 2, width + room) areas and slants
    waves: Array  # (M, R) what the unfinished block's moments bring to each row
    before: Array  # (M + 1,) primitives of ``place``
    place: float = -1.0  # where the last interval ended, from the block's middle in units of its half
    count: int = 0  # intervals in the unfinished block
    begin: float = -math.inf  # s: where it begins
    last: float = 0.0  # s: end of the last interval


def start(grid: Lines, width: int, memory: float = math.inf, room: int = 0) -> Transform:
    """Empty transform of ``width`` signals, with ``room`` for further columns, which stay zero."""
    done, values = np.zeros((grid.rows, width + room)), np.zeros((BLOCK, 2, width + room))
    kernels, waves = np.zeros((BLOCK, 2, MOMENTS)), np.zeros((MOMENTS, grid.rows))
    return Transform(grid, width, memory, done, kernels, values, waves, _FROM)


def add(state: Transform, begin: float, end: float, area: Array, slant: Array) -> None:
    """Add the interval begin..end (s) with the signals' areas and slants (width,), see the module's text.

    Intervals follow each other without a gap, unless there is a ``restart`` between them.
    """
    grid = state.grid
    if not state.count or state.count == BLOCK or end > state.begin + grid.span:
        _begin_block(state, begin)
    i, kernel = state.count, state.kernels[state.count]
    if end > state.begin + grid.span:
        state.waves, kernel[:] = exact(grid, begin, end), _ITSELF
    else:
        right = (end - state.begin) * grid.scale - 1.0
        after = primitives(right)
        weigh(state.before, after, state.place, right, end - begin, kernel)
        state.place, state.before = right, after
    if math.isfinite(state.memory):
        kernel *= _growth(state.memory, 0.5 * (begin + end) - state.begin)
    state.values[i, 0, : state.width] = area
    state.values[i, 1, : state.width] = slant
    state.count, state.last = i + 1, end


def _begin_block(state: Transform, begin: float) -> None:
    """Finish the block under way, if there is one, and begin another at ``begin`` (s)."""
    if state.count:
        state.done = _total(state.done, state.waves, state.kernels, state.values)
    if math.isfinite(state.memory):
        state.done *= _growth(state.memory, state.begin - begin)
    state.begin, state.count, state.kernels[:] = begin, 0, 0.0
    state.waves = basis(state.grid, np.array(begin))
    state.place, state.before = -1.0, _FROM


def _growth(memory: float, time: float) -> float:
    """Growth over some ``time`` (s): within a block instead of decay, taken back when the block is read."""
    return math.exp(time / (2.0 * memory))


def _total(done: Array, waves: Array, kernels: Array, values: Array) -> Array:
    """(R, width + room) the finished blocks and the unfinished one's part."""
    total: Array = waves.T.dot(kernels.reshape(-1, MOMENTS).T.dot(values.reshape(-1, values.shape[-1])))
    total += done
    return total


class _Blocks(NamedTuple):
    """Consecutive blocks, of which the first is under way."""

    begins: Array  # (n,) s
    ends: list[int]  # (n,) how many of the intervals given lie before the end of each
    kernels: Array  # (n, BLOCK, 2, M) as in ``Transform``
    values: Array  # (n, BLOCK, 2, width + room)
    waves: Array  # (n, M, R)


def add_many(
    state: Transform, begins: Array, ends: Array, areas: Array, slants: Array, stops: Sequence[int] = ()
) -> Array:
    """``add`` for N consecutive intervals, to the last bit.

    ``begins`` and ``ends`` (N,) s; ``areas`` and ``slants`` (N, width). Returns (K, R, width + room) what ``current``
    is after so many of the intervals, at least one, as the K ``stops`` say, which do not decrease.
    """
    found, told = np.empty((len(stops), *state.done.shape)), 0
    if ends.size and not state.count:
        _begin_block(state, float(begins[0]))
    for first in range(0, ends.size, _PORTION):
        part, upto = slice(first, first + _PORTION), bisect_right(stops, first + _PORTION)
        blocks = _blocks(state, begins[part], ends[part], areas[part], slants[part])
        inside = [stop - first for stop in stops[told:upto]]
        _sum_up(state, blocks, ends[part], inside, found[told:upto])
        told = upto
    return found


def _cut(
    begin: float, count: int, span: float, begins: list[float], ends: list[float]
) -> tuple[list[float], list[int]]:
    """Begins (s) and ends, as in ``_Blocks``, of the blocks that take in intervals.

    The first of them began at ``begin`` (s) and holds ``count`` intervals already; none is longer than ``span`` (s).
    """
    starts, stops, at = [begin], [], 0
    while True:
        fit = bisect_right(ends, starts[-1] + span, at, min(at + BLOCK - count, len(ends)))
        # an interval that is too long is a block of its own
        at = fit if count else max(fit, at + 1)
        stops.append(at)
        if at == len(ends):
            return starts, stops
        starts.append(begins[at])
        count = 0


def _blocks(state: Transform, begins: Array, ends: Array, areas: Array, slants: Array) -> _Blocks:
    """The blocks that take in these intervals."""
    grid, held = state.grid, state.count
    starts, stops = _cut(state.begin, held, grid.span, begins.tolist(), ends.tolist())
    begin, firsts = np.array(starts), np.array([0, *stops[:-1]])
    which = np.repeat(np.arange(begin.size), np.diff(stops, prepend=0))
    weighed, waves = _weighed(state, begin[which], firsts[1:], begins, ends), basis(grid, begin)
    kernels, values = np.zeros((begin.size, BLOCK, 2, MOMENTS)), np.zeros((begin.size, *state.values.shape))
    for i, (first, stop) in enumerate(zip(firsts.tolist(), stops, strict=True)):
        given, place = slice(first, stop), slice(0 if i else held, stop - first + (0 if i else held))
        kernels[i, place] = weighed[given]
        values[i, place, 0, : state.width], values[i, place, 1, : state.width] = areas[given], slants[given]
    kernels[0, :held], values[0, :held], waves[0] = state.kernels[:held], state.values[:held], state.waves
    for i in np.flatnonzero(ends > begin[which] + grid.span).tolist():
        waves[which[i]] = exact(grid, float(begins[i]), float(ends[i]))
    return _Blocks(begin, stops, kernels, values, waves)


def _weighed(state: Transform, origin: Array, firsts: NDArray[np.intp], begins: Array, ends: Array) -> Array:
    """(N, 2, M) moments of intervals in blocks that begin at ``origin`` (N,) s; ``firsts`` begin another block."""
    grid = state.grid
    right = (ends - origin) * grid.scale - 1.0
    after = primitives(right[:, None])
    left, before = np.append(state.place, right[:-1]), np.concatenate([state.before[None], after[:-1]])
    left[firsts], before[firsts] = -1.0, _FROM
    kernels = np.empty((ends.size, 2, MOMENTS))
    weigh(before, after, left[:, None], right[:, None], (ends - begins)[:, None], kernels)
    kernels[ends > origin + grid.span] = _ITSELF
    if math.isfinite(state.memory):
        since = 0.5 * (begins + ends) - origin
        kernels *= np.array([_growth(state.memory, time) for time in since.tolist()])[:, None, None]
    state.place, state.before = float(right[-1]), after[-1]
    return kernels


def _sum_up(state: Transform, blocks: _Blocks, ends: Array, stops: Sequence[int], found: Array) -> None:
    """Finish all blocks but the last, which is under way then; ``found`` (K, R, width + room): what is at the stops."""
    fades, first, told = math.isfinite(state.memory), -state.count, 0
    parts = _summed(blocks.waves, blocks.kernels, blocks.values)
    _sum_to(blocks, first, stops, found)
    for i, end in enumerate(blocks.ends):
        if i:
            begin, first = float(blocks.begins[i]), blocks.ends[i - 1]
            state.done = parts[i - 1] + state.done
            if fades:
                state.done *= _growth(state.memory, state.begin - begin)
            state.begin = begin
        while told < len(stops) and stops[told] <= end:
            found[told] += state.done
            if fades:
                found[told] *= _growth(state.memory, state.begin - float(ends[stops[told] - 1]))
            told += 1
    state.kernels, state.values = blocks.kernels[-1].copy(), blocks.values[-1].copy()
    state.waves, state.count, state.last = blocks.waves[-1].copy(), blocks.ends[-1] - first, float(ends[-1])


def _sum_to(blocks: _Blocks, first: int, stops: Sequence[int], found: Array) -> None:
    """Into ``found`` what the blocks of the stops bring up to there; the first block begins with interval ``first``."""
    which = np.searchsorted(blocks.ends, stops)
    count = np.array(stops, np.intp) - np.array([first, *blocks.ends[:-1]])[which]
    kernels = blocks.kernels[which] * (count[:, None] > _PLACES)[:, :, None, None]
    _summed(blocks.waves[which], kernels, blocks.values[which], found)


def _summed(waves: Array, kernels: Array, values: Array, out: Array | None = None) -> Array:
    """(n, R, width + room) what n blocks bring, see ``Transform``."""
    sums = _in_rows(kernels).swapaxes(-1, -2) @ _in_rows(values)
    return np.asarray(np.matmul(waves.swapaxes(-1, -2), sums, out=out))


def _in_rows(blocks: Array) -> Array:
    """(n, 2 BLOCK, ...) of blocks (n, BLOCK, 2, ...)."""
    return blocks.reshape(len(blocks), 2 * BLOCK, blocks.shape[-1])


def restart(state: Transform, time: float) -> None:
    """Forget all; the transform goes on at ``time`` (s)."""
    state.done, state.count, state.last = np.zeros_like(state.done), 0, time


def as_it_was(state: Transform, time: float, lines: Array) -> Transform:
    """The transform of an earlier ``time`` (s), as ``current`` told it then."""
    kernels, values = np.zeros_like(state.kernels), np.zeros_like(state.values)
    return replace(state, done=lines, kernels=kernels, values=values, count=0, begin=time, last=time)


def take_out(state: Transform, part: Array) -> None:
    """Forget a ``part`` (R, width) of the transform up to the last sample, such as all up to some time ago."""
    state.done = current(state) - part
    state.begin, state.count = state.last, 0


def current(state: Transform) -> Array:
    """(R, width + room) the transform up to the last sample: real parts, imaginary parts, integrals."""
    if not state.count:
        return state.done.copy()
    total = _total(state.done, state.waves, state.kernels, state.values)
    if math.isfinite(state.memory):
        total *= _growth(state.memory, state.begin - state.last)
    return total
