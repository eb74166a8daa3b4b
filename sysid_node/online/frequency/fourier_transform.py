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

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BLOCK = 16  # intervals in a block at most
MOMENTS = 12
_SPAN = 1.25  # rad, by which the highest line's phase turns in a block at most: 0.625^12 / 12! is 7e-12
_ONE = np.ones(1)
_LANES = 8  # vectors are padded to whole SIMD registers: a value's bits then do not depend on its place


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


def basis(grid: Lines, begin: float) -> Array:
    """(M, R) what each moment brings to each row, in a block that begins at ``begin`` (s).

    Moments are taken about the block's middle, in units of its half.
    """
    phase, P = (begin + grid.half) * grid.padded, grid.padded.size
    waves = np.ones(2 * P + 1)
    waves[:P], waves[P : 2 * P] = np.cos(phase), np.sin(phase)
    found: Array = waves.take(grid.waves)
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


#: The moments of such an interval are the area and the slant themselves.
_ITSELF = np.eye(2, MOMENTS)
#: Ratios of x^k / k to x^(k-1) / (k-1), over x.
_RATIOS = np.maximum(np.arange(MOMENTS + 1.0), 1.0) / np.arange(1.0, MOMENTS + 2.0)


#: Primitives x^k / k at the beginning of a block, x = -1.
_AT_BEGIN = np.multiply.accumulate(-_RATIOS)


@dataclass
class Transform:
    """Running transform: the finished blocks, and the block that is being filled."""

    grid: Lines
    width: int  # signals
    memory: float  # s: tau of the energy's decay, inf = none
    done: Array  # (R, width + room) the finished blocks, decayed to ``begin``
    kernels: Array  # (BLOCK, 2, M) moments of areas and slants in the unfinished block, zero behind them
    values: Array  # (BLOCK, 2, width + room) areas and slants
    waves: Array  # (M, R) what the unfinished block's moments bring to each row
    powers: Array  # (BLOCK + 1, M + 1) x^k / k, k from 1, at the block's begin and at the intervals' ends x
    place: float = -1.0  # end of the last interval, from the block's middle in units of its half
    count: int = 0  # intervals in the unfinished block
    begin: float = -math.inf  # s: where the unfinished block begins
    last: float = 0.0  # s: end of the last interval


def start(grid: Lines, width: int, memory: float = math.inf, room: int = 0) -> Transform:
    """An empty transform of ``width`` signals, with ``room`` for further columns, which stay zero."""
    done, values = np.zeros((width + room, grid.rows)).T, np.zeros((BLOCK, 2, width + room))
    kernels, waves = np.zeros((BLOCK, 2, MOMENTS)), np.zeros((MOMENTS, grid.rows))
    powers = np.tile(_AT_BEGIN, (BLOCK + 1, 1))
    return Transform(grid, width, memory, done, kernels, values, waves, powers)


def add(state: Transform, begins: Sequence[float], ends: Sequence[float], areas: Array, slants: Array) -> None:
    """Add n consecutive intervals (s) with the signals' ``areas`` and ``slants`` (n, width), see the module's text.

    Intervals follow each other without a gap, unless there is a ``restart`` between them. Intervals that are added
    together give the same bits as those that are added one by one.
    """
    first, span = 0, state.grid.span
    while first < len(ends):
        if not state.count or state.count == BLOCK or ends[first] > state.begin + span:
            _begin_block(state, begins[first])
        stop = bisect_right(ends, state.begin + span, first, min(first + BLOCK - state.count, len(ends)))
        stop = max(stop, first + 1)
        filled = slice(state.count, state.count + stop - first)
        if ends[first] > state.begin + span:  # an interval that is longer than a block is a block of its own
            state.waves, state.kernels[0] = exact(state.grid, begins[first], ends[first]), _ITSELF
        else:
            _set_moments(state, begins[first:stop], ends[first:stop], filled)
        if math.isfinite(state.memory):
            middles = [0.5 * (a + b) - state.begin for a, b in zip(begins[first:stop], ends[first:stop], strict=True)]
            state.kernels[filled] *= np.array([_growth(state.memory, middle) for middle in middles])[:, None, None]
        state.values[filled, 0, : state.width] = areas[first:stop]
        state.values[filled, 1, : state.width] = slants[first:stop]
        state.count, state.last, first = filled.stop, ends[stop - 1], stop


def _set_moments(state: Transform, begins: Sequence[float], ends: Sequence[float], filled: slice) -> None:
    """Set the moments of the areas and slants of intervals that lie within the block under way.

    What is computed per interval is cheaper with Python's floats than with short arrays.
    """
    place, scale, weights, places = state.place, state.grid.scale, [], []
    for begin, end in zip(begins, ends, strict=True):
        left, place = place, (end - state.begin) * scale - 1.0
        width = place - left
        places.append(place)
        weights.append((1.0 / width, -0.5 * (place + left), 2.0 / (width * width * (end - begin))))
    powers, state.place = state.powers[filled.start : filled.stop + 1], place
    np.multiply.accumulate(np.multiply.outer(places, _RATIOS), axis=-1, out=powers[1:])
    integrals, factors = powers[1:] - powers[:-1], np.array(weights)[:, :, None]
    of_area, of_slant = state.kernels[filled, 0], state.kernels[filled, 1]
    np.multiply(integrals[:, :-1], factors[:, 0], out=of_area)
    np.multiply(integrals[:, :-1], factors[:, 1], out=of_slant)
    of_slant += integrals[:, 1:]
    of_slant *= factors[:, 2]


def _begin_block(state: Transform, begin: float) -> None:
    """Finish the block under way, if there is one, and begin another at ``begin`` (s)."""
    if state.count:
        state.done = _total(state)
    if math.isfinite(state.memory):
        state.done *= _growth(state.memory, state.begin - begin)
    state.begin, state.count, state.kernels[:] = begin, 0, 0.0
    state.waves = basis(state.grid, begin)
    state.place = -1.0


def _growth(memory: float, time: float) -> float:
    """Growth over some ``time`` (s): within a block instead of decay, taken back when the block is read."""
    return math.exp(time / (2.0 * memory))


def _total(state: Transform) -> Array:
    """(R, width + room) the finished blocks and the unfinished one's part; each signal's rows lie in one piece."""
    moments = state.values.reshape(-1, state.values.shape[-1]).T.dot(state.kernels.reshape(-1, MOMENTS))
    total: Array = moments.dot(state.waves).T
    total += state.done
    return total


def restart(state: Transform, time: float) -> None:
    """Forget all; the transform goes on at ``time`` (s)."""
    state.done, state.count, state.last = np.zeros_like(state.done), 0, time


def impulse(omega: Array, time: float) -> Array:
    """(2F + 1,) the transform of a unit impulse at ``time`` (s), at lines ``omega`` (F,) rad/s."""
    wave = np.exp((-1j * time) * omega)
    return np.concatenate([wave.real, wave.imag, _ONE])


def take_out(state: Transform, part: Array) -> None:
    """Forget a ``part`` (R, width + room) of the transform up to the last sample, such as all up to some time ago."""
    state.done = current(state) - part
    state.begin, state.count = state.last, 0


def at_rest(state: Transform) -> Transform:
    """A copy that stays at the last sample: none is to be added."""
    return replace(state, done=current(state), begin=state.last, count=0)


def current(state: Transform) -> Array:
    """(R, width + room) the transform up to the last sample: real parts, imaginary parts, integrals."""
    if not state.count:
        return state.done.copy(order="K")
    total = _total(state)
    if math.isfinite(state.memory):
        total *= _growth(state.memory, state.begin - state.last)
    return total
