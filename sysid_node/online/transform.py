"""Recursive finite Fourier transform of irregularly sampled signals, exact for piecewise-linear signals.

    X(omega) = integral of x(t) exp(-j omega t) exp(-(T - t) / 2 tau) dt

Morelli, "Real-time parameter estimation in the frequency domain", J. Guidance 23(5), 2000, eqs. 10 to 13, with three
changes. The samples' own times are used: between two samples the signal is the straight line, whose transform over an
interval of length h about its middle t_m is

    h exp(-j omega t_m) (mean sinc(phi) - j half-difference s(phi)),
    phi = omega h / 2,  s = (sin phi - phi cos phi) / phi^2

so that jitter, lost and late samples do not bias it. A rate's derivative enters as its increment over the interval,
constant between the samples of the same straight line: summed by parts this is j omega X plus the boundary terms of the
finite transform, without differentiating anything. Phases come from absolute time, so nothing drifts.

Samples are collected in blocks of ``BLOCK``; a block is one matrix product. The transform at any sample is the sum of
the finished blocks and the unfinished one, so the per-sample and the vectorised path give the same bits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BLOCK = 16
_LANES = 8  # vectors are padded to whole SIMD registers: a value's bits then do not depend on its place


@dataclass
class Lines:
    """The frequency lines and what the weights need of them."""

    omega: Array  # (F,) rad/s
    padded: int  # F rounded up to whole registers
    phase: Array = field(init=False)  # (3P,) rad/s: omega thrice
    shift: Array = field(init=False)  # (3P,) rad: 0, pi/2, pi: cosines become cos, -sin, -cos
    sinc: tuple[Array, Array] = field(init=False)  # coefficients of h^2 and h^4 in sinc(phi)
    slope: tuple[Array, Array] = field(init=False)  # coefficients of h and h^3 in s(phi)
    padding: NDArray[np.intp] = field(init=False)  # rows that are only there to fill registers

    def __post_init__(self) -> None:
        spare = np.arange(self.omega.size, self.padded)
        self.padding = np.concatenate([spare, self.padded + spare])
        w = np.zeros(self.padded)
        w[: self.omega.size] = self.omega
        self.phase = np.tile(w, 3)
        self.shift = np.repeat([0.0, 0.5 * math.pi, math.pi], self.padded)
        w2 = np.tile(w, 2)
        self.sinc = (-(w2**2) / 24.0, w2**4 / 1920.0)  # sinc(phi) = 1 - phi^2/6 + phi^4/120 - ...
        self.slope = (w2 / 6.0, -(w2**3) / 240.0)  # s(phi) = phi/3 (1 - phi^2/10 + ...)

    @property
    def rows(self) -> int:
        """Rows that are accumulated: real parts, imaginary parts (both padded), and the integral (zero frequency)."""
        return 2 * self.padded + 1

    @property
    def count(self) -> int:
        """Number of lines F."""
        return int(self.omega.size)


def lines(start_hz: float, step_hz: float, stop_hz: float) -> Lines:
    """Lines from start to stop (Hz), both included where the step meets them."""
    count = math.floor((stop_hz - start_hz) / step_hz + 1e-9) + 1
    omega = 2.0 * math.pi * (start_hz + step_hz * np.arange(count, dtype=np.float64))
    return Lines(omega, -(-count // _LANES) * _LANES)


def weights(grid: Lines, middle: Array | float, step: Array | float, out: Array) -> None:
    """Two rows a sample into ``out`` (..., 2, rows): for the mean and the half-difference over the interval.

    ``middle`` and ``step`` (s) are scalars or (N, 1). The last column integrates: h for the mean, 0 for the difference.
    """
    wide = 2 * grid.padded
    wave = np.cos(grid.phase * middle + grid.shift)
    square = step * step
    np.multiply(
        wave[..., :wide], step + (step * square) * (grid.sinc[0] + square * grid.sinc[1]), out=out[..., 0, :wide]
    )
    np.multiply(wave[..., grid.padded :], square * (grid.slope[0] + square * grid.slope[1]), out=out[..., 1, :wide])


@dataclass
class Transform:
    """Running transform: the finished blocks and the one being filled."""

    grid: Lines
    width: int
    memory: float  # s: tau of the energy's decay, inf = none
    done: Array  # (rows, width) at ``base``
    kernels: Array  # (2 BLOCK, rows) weights of the unfinished block
    values: Array  # (2 BLOCK, width) means and half-differences
    squares: Array  # (width,) integral of the signals squared over the finished blocks; does not fade
    count: int = 0  # samples in the unfinished block
    base: float = 0.0  # s: time to which ``done`` has decayed
    last: float = 0.0  # s: end of the last interval


def start(grid: Lines, width: int, memory: float = math.inf) -> Transform:
    """Empty transform of ``width`` signals."""
    kernels = np.zeros((2 * BLOCK, grid.rows))
    values = np.zeros((2 * BLOCK, width))
    return Transform(grid, width, memory, np.zeros((grid.rows, width)), kernels, values, np.zeros(width))


def add(state: Transform, begin: float, end: float, mean: Array, half: Array) -> None:
    """Add the interval begin..end (s) over which signals go in a straight line from mean - half to mean + half."""
    i = 2 * state.count
    step = end - begin
    weights(state.grid, begin + 0.5 * step, step, state.kernels[i : i + 2])
    state.kernels[i, -1] = step
    _append(state, i, end, mean, half)


def add_many(state: Transform, kernels: Array, ends: Array, means: Array, halves: Array) -> None:
    """``add`` for consecutive intervals with weights (N, 2, rows) that ``weights`` has computed, to the last bit.

    ``ends`` (N,) s; ``means`` and ``halves`` (N, width).
    """
    if math.isfinite(state.memory):
        for kernel, end, mean, half in zip(kernels, ends.tolist(), means, halves, strict=True):
            i = 2 * state.count
            state.kernels[i : i + 2] = kernel
            _append(state, i, end, mean, half)
        return
    begin = 0
    while begin < ends.size:
        i, n = 2 * state.count, min(BLOCK - state.count, ends.size - begin)
        part = slice(begin, begin + n)
        state.kernels[i : i + 2 * n] = kernels[part].reshape(2 * n, -1)
        state.values[i : i + 2 * n : 2] = means[part]
        state.values[i + 1 : i + 2 * n : 2] = halves[part]
        state.count += n
        begin += n
        if state.count == BLOCK:
            _finish_block(state)
    state.last = float(ends[-1])


def _append(state: Transform, i: int, end: float, mean: Array, half: Array) -> None:
    if state.count == 0 and math.isfinite(state.memory):
        decay(state, end)
    values = state.values
    values[i] = mean
    values[i + 1] = half
    if math.isfinite(state.memory):
        # within a block growth instead of decay, taken back when the block is read
        values[i : i + 2] *= math.exp((end - state.base) / (2.0 * state.memory))
    state.count += 1
    state.last = end
    if state.count == BLOCK:
        _finish_block(state)
        decay(state, end)


def _finish_block(state: Transform) -> None:
    state.done += state.kernels.T @ state.values
    state.squares = energy(state)
    state.count = 0


def decay(state: Transform, time: float) -> None:
    """Let the finished blocks decay to ``time`` (s)."""
    if math.isfinite(state.memory):
        state.done *= math.exp((state.base - time) / (2.0 * state.memory))
    state.base = time


def current(state: Transform) -> Array:
    """(2F + 1, width) the transform up to the last sample: real parts, imaginary parts, integrals."""
    n = 2 * state.count
    total = state.done + state.kernels[:n].T @ state.values[:n] if n else state.done.copy()
    if math.isfinite(state.memory):
        total *= math.exp((state.base - state.last) / (2.0 * state.memory))
    if state.grid.padded == state.grid.count:
        return total
    return np.delete(total, state.grid.padding, axis=0)


def energy(state: Transform) -> Array:
    """(width,) integral of the signals squared up to the last sample."""
    n = 2 * state.count
    total: Array = state.squares + state.kernels[:n:2, -1] @ state.values[:n:2] ** 2
    return total
