"""Recursive finite Fourier transform of irregularly sampled signals, exact for piecewise-linear signals.

    X(omega) = integral of x(t) exp(-j omega t) exp(-(T - t) / 2 tau) dt

Morelli, "Real-time parameter estimation in the frequency domain", J. Guidance 23(5), 2000, eqs. 10 to 13, with three
changes. The samples' own times are used: between two samples the signal is the straight line, whose transform over an
interval of length h about its middle t_m is

    exp(-j omega t_m) (area sinc(phi) - j slant s(phi) / h),
    phi = omega h / 2,  s = (sin phi - phi cos phi) / phi^2

with the area h (x_0 + x_1) / 2 and the slant h^2 (x_1 - x_0) / 2, so that jitter, lost and late samples do not bias it.
A rate's derivative enters as its increment over the interval, which is the derivative's area: summed by parts this is
j omega X plus the boundary terms of the finite transform, without differentiating anything. Phases come from absolute
time, so nothing drifts.

Samples are collected in blocks of ``BLOCK``; a block is one matrix product. The transform at any sample is the sum of
the finished blocks and the unfinished one, so the per-sample and the vectorised path give the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BLOCK = 16
_LANES = 8  # vectors are padded to whole SIMD registers: a value's bits then do not depend on its place
_PORTION = 64  # intervals that are weighed at once: what they need stays in the processor's caches
_SMALL = 0.15  # phi up to which the power series of sinc and s are right to 1e-8


@dataclass
class Lines:
    """The frequency lines, padded to P, and what the weights need of them.

    Areas are weighed with cos and -sin, times sinc(phi), slants with -sin and -cos, times s(phi) / h.
    """

    omega: Array  # (F,) rad/s
    padded: Array = field(init=False)  # (P,) rad/s: padded to whole registers
    sign: Array = field(init=False)  # (2, 2P) of the waves
    series: tuple[Array, Array, Array] = field(init=False)  # (2, 2P): signed gains in powers of h^2
    longest: float = field(init=False)  # s: step up to which the series hold
    padding: NDArray[np.intp] = field(init=False)  # rows that are only there to fill registers

    def __post_init__(self) -> None:
        F, P = self.omega.size, -(-self.omega.size // _LANES) * _LANES
        self.padding = np.concatenate([np.arange(F, P), np.arange(P + F, 2 * P)])
        self.padded = np.ones(P)
        self.padded[:F] = self.omega
        self.sign = np.repeat([[1.0, -1.0], [-1.0, -1.0]], P, axis=1)
        # sinc(phi) = 1 - phi^2/6 + phi^4/120 - ..., s(phi) = phi/3 - phi^3/30 + phi^5/840 - ...
        half = np.tile(0.5 * self.padded, 2)
        self.series = (
            np.stack([np.ones(2 * P), half / 3.0]) * self.sign,
            np.stack([-(half**2) / 6.0, -(half**3) / 30.0]) * self.sign,
            np.stack([half**4 / 120.0, half**5 / 840.0]) * self.sign,
        )
        self.longest = 2.0 * _SMALL / float(self.omega[-1])

    @property
    def rows(self) -> int:
        """Rows that are accumulated: real parts, imaginary parts (both padded), and the integral (zero frequency)."""
        return 2 * self.padded.size + 1

    @property
    def count(self) -> int:
        """Number of lines F."""
        return int(self.omega.size)


def lines(start_hz: float, step_hz: float, stop_hz: float) -> Lines:
    """Lines from start to stop (Hz), both included where the step meets them."""
    count = math.floor((stop_hz - start_hz) / step_hz + 1e-9) + 1
    omega = 2.0 * math.pi * (start_hz + step_hz * np.arange(count, dtype=np.float64))
    return Lines(omega)


def weights(grid: Lines, middle: float, step: float, out: Array) -> None:
    """Weights of an interval's area and slant into ``out`` (2, rows); ``middle`` and ``step`` in s."""
    square, P = step * step, grid.padded.size
    phase, waves = grid.padded * middle, out[:, :-1]
    waves[0, :P] = waves[1, P:] = np.cos(phase)
    waves[0, P:] = waves[1, :P] = np.sin(phase)
    gains = grid.series[2] * square
    gains += grid.series[1]
    gains *= square
    gains += grid.series[0]
    if step > grid.longest:
        gains = _exact_gains(grid, step)
    waves *= gains


def weights_of_many(grid: Lines, middles: Array, steps: Array) -> Array:
    """(N, 2, rows) weights of N intervals, to the last bit those of ``weights``; middles and steps (N,) s."""
    kernels, P = blank_kernels(grid, steps.size), grid.padded.size
    phase, squares = grid.padded * middles[:, None], (steps * steps)[:, None, None]
    kernels[:, 0, :P] = kernels[:, 1, P:-1] = np.cos(phase)
    kernels[:, 0, P:-1] = kernels[:, 1, :P] = np.sin(phase)
    gains = grid.series[2] * squares
    gains += grid.series[1]
    gains *= squares
    gains += grid.series[0]
    for i in np.flatnonzero(steps > grid.longest).tolist():
        gains[i] = _exact_gains(grid, float(steps[i]))
    kernels[:, :, :-1] *= gains
    return kernels


def blank_kernels(grid: Lines, count: int) -> Array:
    """(count, 2, rows) weights of which only the last column is set: the integral is the sum of the areas."""
    kernels = np.zeros((count, 2, grid.rows))
    kernels[:, 0, -1] = 1.0
    return kernels


def _exact_gains(grid: Lines, step: float) -> Array:
    """(2, 2P) sinc(phi) and s(phi) / h, signed."""
    phi = np.tile(0.5 * step * grid.padded, 2)
    sine = np.sin(phi)
    gains: Array = np.stack([sine / phi, (sine - phi * np.cos(phi)) / (phi * phi * step)]) * grid.sign
    return gains


@dataclass
class Transform:
    """Running transform: the finished blocks and the one being filled."""

    grid: Lines
    width: int  # signals
    memory: float  # s: tau of the energy's decay, inf = none
    done: Array  # (rows, width + room) at ``base``
    kernels: Array  # (BLOCK, 2, rows) weights of the unfinished block
    values: Array  # (BLOCK, 2, width + room) areas and slants
    count: int = 0  # samples in the unfinished block
    base: float = 0.0  # s: time to which ``done`` has decayed
    last: float = 0.0  # s: end of the last interval


def start(grid: Lines, width: int, memory: float = math.inf, room: int = 0) -> Transform:
    """Empty transform of ``width`` signals, with ``room`` for further columns, which stay zero."""
    done, values = np.zeros((grid.rows, width + room)), np.zeros((BLOCK, 2, width + room))
    return Transform(grid, width, memory, done, blank_kernels(grid, BLOCK), values)


def add(state: Transform, begin: float, end: float, area: Array, slant: Array) -> None:
    """Add the interval begin..end (s) with the signals' areas and slants (width,), see the module's text."""
    step = end - begin
    weights(state.grid, begin + 0.5 * step, step, state.kernels[state.count])
    _append(state, begin, end, area, slant)


def add_many(
    state: Transform, begins: Array, ends: Array, areas: Array, slants: Array, stops: Sequence[int] = ()
) -> Array:
    """``add`` for N consecutive intervals, to the last bit.

    ``begins`` and ``ends`` (N,) s; ``areas`` and ``slants`` (N, width). Returns (K, 2F + 1, width + room) what
    ``current`` is after so many of the intervals, at least one, as the K ``stops`` say, which do not decrease.
    """
    add_some = _add_blocks if math.isinf(state.memory) else _add_singly
    found: list[Array] = []
    for first in range(0, ends.size, _PORTION):
        part = slice(first, first + _PORTION)
        begin, end = begins[part], ends[part]
        steps = end - begin
        kernels = weights_of_many(state.grid, begin + 0.5 * steps, steps)
        values = np.zeros((end.size, *state.values.shape[1:]))
        values[:, 0, : state.width], values[:, 1, : state.width] = areas[part], slants[part]
        inside = [stop - first for stop in stops if first < stop <= first + _PORTION]
        found += add_some(state, kernels, begin, end, values, inside)
    return np.array(found).reshape(len(stops), 2 * state.grid.count + 1, state.values.shape[-1])


def _add_singly(
    state: Transform, kernels: Array, begins: Array, ends: Array, values: Array, stops: Sequence[int]
) -> list[Array]:
    """``add_many`` where weights depend on the time to which all has decayed."""
    found: list[Array] = []
    for i, (begin, end) in enumerate(zip(begins.tolist(), ends.tolist(), strict=True)):
        state.kernels[state.count] = kernels[i]
        _append(state, begin, end, *values[i, :, : state.width])
        while len(found) < len(stops) and stops[len(found)] == i + 1:
            found.append(current(state))
    return found


def _add_blocks(
    state: Transform, kernels: Array, begins: Array, ends: Array, values: Array, stops: Sequence[int]
) -> list[Array]:
    """``add_many`` where nothing decays: whole blocks as they lie."""
    found: list[Array] = []
    at = 0
    while at < ends.size:
        held = state.count
        size = min(BLOCK - held, ends.size - at)
        block = kernels[at : at + size], values[at : at + size]
        if size < BLOCK:
            state.kernels[held : held + size], state.values[held : held + size] = block
            block = state.kernels, state.values
        while len(found) < len(stops) and stops[len(found)] <= at + size:
            count = held + stops[len(found)] - at
            found.append(_counted(state.grid, _total(state.done, block[0][:count], block[1][:count])))
        at, state.count = at + size, held + size
        if state.count == BLOCK:
            state.done, state.count = _total(state.done, *block), 0
    state.last = float(ends[-1])
    return found


def _append(state: Transform, begin: float, end: float, area: Array, slant: Array) -> None:
    i, fades = state.count, math.isfinite(state.memory)
    if fades:
        if i == 0:
            decay(state, end)
        # within a block growth instead of decay, taken back when the block is read
        growth = math.exp((0.5 * (begin + end) - state.base) / (2.0 * state.memory))
        kernel = state.kernels[i]
        kernel[:, :-1] *= growth
        kernel[0, -1] = growth
    state.values[i, 0, : state.width] = area
    state.values[i, 1, : state.width] = slant
    state.count = i + 1
    state.last = end
    if state.count == BLOCK:
        _finish_block(state)
        decay(state, end)


def _total(done: Array, kernels: Array, values: Array) -> Array:
    """(rows, width + room) the finished blocks and the unfinished one's part, of n weights and values."""
    if not len(kernels):
        return done.copy()
    total: Array = kernels.reshape(-1, kernels.shape[-1]).T @ values.reshape(-1, values.shape[-1])
    total += done
    return total


def _counted(grid: Lines, total: Array) -> Array:
    """The rows that are not there to fill registers."""
    return np.delete(total, grid.padding, axis=0) if grid.padding.size else total


def _finish_block(state: Transform) -> None:
    state.done, state.count = _total(state.done, state.kernels, state.values), 0


def restart(state: Transform, time: float) -> None:
    """Forget all; the transform goes on at ``time`` (s)."""
    state.done[:], state.count, state.last = 0.0, 0, time


def take_out(state: Transform, part: Array) -> None:
    """Forget a ``part`` (2F + 1, width) of the transform up to the last sample, such as all up to some time ago."""
    counted = np.delete(np.arange(state.grid.rows), state.grid.padding)
    growth = math.exp((state.last - state.base) / (2.0 * state.memory)) if math.isfinite(state.memory) else 1.0
    state.done[counted] -= growth * part


def decay(state: Transform, time: float) -> None:
    """Let the finished blocks decay to ``time`` (s)."""
    if math.isfinite(state.memory):
        state.done *= math.exp((state.base - time) / (2.0 * state.memory))
    state.base = time


def current(state: Transform) -> Array:
    """(2F + 1, width + room) the transform up to the last sample: real parts, imaginary parts, integrals."""
    total = _total(state.done, state.kernels[: state.count], state.values[: state.count])
    if math.isfinite(state.memory):
        total *= math.exp((state.base - state.last) / (2.0 * state.memory))
    return _counted(state.grid, total)
