"""The recursive transform against SciPy's quadrature, exact identities and sums in extended precision."""

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from sysid_node.online.frequency import fourier_transform
from sysid_node.online.frequency.fourier_transform import BLOCK, Lines, Transform

Array = NDArray[np.float64]
GRID = fourier_transform.lines(0.1, 0.3, 1.9)


def irregular(count: int, seed: int = 0, start: float = 3.0) -> Array:
    """Times at about 50 Hz with jitter and every third sample lost."""
    rng = np.random.default_rng(seed)
    nominal = start + 0.02 * np.arange(2 * count) + rng.uniform(-0.004, 0.004, 2 * count)
    return nominal[rng.random(nominal.size) > 0.33][:count]


def fed(grid: Lines, time: Array, signals: Array, memory: float = math.inf) -> Transform:
    """Transform of signals (N, W) that go in straight lines between the samples."""
    state = fourier_transform.start(grid, signals.shape[1], memory)
    for (begin, end), (before, after) in zip(pairwise(time.tolist()), pairwise(signals), strict=True):
        step = end - begin
        area, slant = 0.5 * step * (before + after), 0.5 * step**2 * (after - before)
        fourier_transform.add(state, [begin], [end], area[None], slant[None])
    return state


def complexes(lines: Array) -> NDArray[np.complex128]:
    """(F, W) X(omega) from the stacked real and imaginary parts."""
    F = (len(lines) - 1) // 2
    return lines[:F] + 1j * lines[F : 2 * F]


def quadrature(time: Array, signal: Array, omega: float, memory: float = math.inf) -> complex:
    """The integral, interval by interval, by adaptive quadrature."""

    def piece(begin: float, end: float, wave: object) -> float:
        return quad(lambda t: np.interp(t, time, signal) * wave(omega * t) * fade(t), begin, end, epsrel=1e-12)[0]

    def fade(t: float) -> float:
        return math.exp((t - time[-1]) / (2.0 * memory))

    real, imaginary = (sum(piece(a, b, wave) for a, b in pairwise(time)) for wave in (math.cos, math.sin))
    return complex(real, -imaginary)


def test_lines_include_both_ends() -> None:
    """36 lines from 0.1 to 1.5 Hz (the grid of Morelli's rtpid), 48 from 0.1 to 1.98."""
    assert fourier_transform.lines(0.1, 0.04, 1.5).count == 36
    assert fourier_transform.lines(0.1, 0.04, 2.0).count == 48
    np.testing.assert_allclose(fourier_transform.lines(0.1, 0.1, 0.3).omega, 2 * np.pi * np.array([0.1, 0.2, 0.3]))


def test_piecewise_linear_signals_at_irregular_times_are_transformed_exactly() -> None:
    time = irregular(60)
    signals = np.random.default_rng(1).normal(size=(60, 2)) + 5.0
    lines = fourier_transform.current(fed(GRID, time, signals))
    expected = [[quadrature(time, x, w) for x in signals.T] for w in GRID.omega]
    np.testing.assert_allclose(complexes(lines), expected, rtol=0, atol=1e-8)
    np.testing.assert_allclose(lines[-1], np.trapezoid(signals, time, axis=0), rtol=1e-13)


def test_long_intervals_are_exact_too() -> None:
    """Where the series of the weights no longer converge: three quarters of the highest line's period."""
    time = np.array([3.0, 3.01, 3.4, 3.41, 3.5])
    x = np.array([1.0, -2.0, 3.0, 0.5, 1.0])
    lines = fourier_transform.current(fed(GRID, time, x[:, None]))
    expected = [[quadrature(time, x, w)] for w in GRID.omega]
    np.testing.assert_allclose(complexes(lines), expected, rtol=0, atol=1e-8)


def test_increments_are_the_transform_of_the_derivative_with_its_boundary_terms() -> None:
    """Integration by parts: F[dx/dt] = j omega X + x(T) exp(-j omega T) - x(0) exp(-j omega 0)."""
    time = irregular(200)
    x = np.random.default_rng(2).normal(size=(200, 1)).cumsum(axis=0)
    slopes = fourier_transform.start(GRID, 1)
    for (begin, end), (before, after) in zip(pairwise(time.tolist()), pairwise(x), strict=True):
        fourier_transform.add(slopes, [begin], [end], (after - before)[None], np.zeros((1, 1)))
    X, w = complexes(fourier_transform.current(fed(GRID, time, x))), GRID.omega[:, None]
    ends = x[-1] * np.exp(-1j * w * time[-1]) - x[0] * np.exp(-1j * w * time[0])
    np.testing.assert_allclose(complexes(fourier_transform.current(slopes)), 1j * w * X + ends, rtol=0, atol=3e-8)


def test_an_impulse_is_what_a_short_pulse_of_unit_area_is() -> None:
    """But for (omega h)^2 / 12 of it, with a triangle that rises and falls within h = 0.1 ms each."""
    time = np.array([7.0 - 1e-4, 7.0, 7.0 + 1e-4])
    pulse = fourier_transform.current(fed(GRID, time, np.array([[0.0], [1e4], [0.0]])))[:, 0]
    np.testing.assert_allclose(fourier_transform.impulse(GRID.omega, 7.0), pulse, rtol=0, atol=2e-7)


def test_jitter_and_lost_samples_do_not_bias() -> None:
    """A sine of 0.5 Hz: what is left is the straight lines' error, (omega h)^2 / 12; sums at nominal times fail."""
    errors, naive = [], []
    for seed in range(20):
        time = irregular(800, seed)
        x = np.sin(math.pi * time)
        X = complexes(fourier_transform.current(fed(GRID, time, x[:, None])))[:, 0]
        rising, falling = ((s * math.pi - GRID.omega) * 1j for s in (1.0, -1.0))
        ends = time[[0, -1], None]
        exact = np.diff((np.exp(rising * ends) / rising - np.exp(falling * ends) / falling) / 2j, axis=0)[0]
        nominal = time[0] + 0.03 * np.arange(800)
        errors.append((X - exact) / abs(exact).max())
        naive.append((0.03 * np.exp(-1j * np.outer(GRID.omega, nominal)) @ x - exact) / abs(exact).max())
    bias = abs(np.mean(errors, axis=0)).max()
    assert bias < 2e-3
    assert np.sqrt(np.mean(np.abs(errors) ** 2)) < 2e-3
    assert np.sqrt(np.mean(np.abs(naive) ** 2)) > 0.05


@pytest.mark.parametrize("memory", [0.7, 4.0])
def test_forgetting_fades_the_window_exponentially(memory: float) -> None:
    """Energy fades with exp(-(T - t) / memory), amplitudes with its root; over an interval all as at its middle."""
    time = irregular(150)
    x = 5.0 + np.random.default_rng(3).normal(size=150)
    X = complexes(fourier_transform.current(fed(GRID, time, x[:, None], memory)))[:, 0]
    expected = np.array([quadrature(time, x, w, memory) for w in GRID.omega[[0, -1]]])
    step = np.diff(time).max()
    np.testing.assert_allclose(X[[0, -1]], expected, rtol=0, atol=abs(expected).max() * (step / memory) ** 2)


def test_old_data_fade_to_nothing_and_nothing_overflows() -> None:
    """Two hours with a memory of half a second: growth within blocks stays small."""
    time = np.concatenate([np.arange(0.0, 2.0, 0.1), np.arange(2.0, 7200.0, 2.0)])
    x = np.where(time < 2.0, 1e6, 1.0)[:, None]
    integral = fourier_transform.current(fed(GRID, time, x, 0.5))[-1, 0]
    assert integral == pytest.approx(2.0 * sum(math.exp(-(1 + 2 * k) / (2 * 0.5)) for k in range(50)), rel=1e-9)


def parts(time: Array, signals: Array) -> tuple[Array, Array]:
    """Areas and slants (n, W) of the intervals."""
    steps = np.diff(time)[:, None]
    before, after = signals[:-1], signals[1:]
    return 0.5 * steps * (before + after), 0.5 * steps**2 * (after - before)


def waves(time: Array) -> Array:
    """(n, 2, R) what areas and slants bring to each row, in closed form."""
    return np.array([fourier_transform.exact(GRID, begin, end)[:2] for begin, end in pairwise(time.tolist())])


@pytest.mark.parametrize("memory", [math.inf, 2.0])
def test_the_recursion_is_the_sum_in_closed_form_at_every_sample(memory: float) -> None:
    """Across all places in a block, its boundaries included, and an interval that is longer than a block."""
    time = irregular(3 * BLOCK + 4)
    time[2 * BLOCK :] += 3.0 * GRID.span
    signals = np.random.default_rng(4).normal(size=(time.size, 3))
    kernels, (areas, slants) = waves(time), parts(time, signals)
    for n in range(1, time.size):
        fade = np.exp((0.5 * (time[:n] + time[1 : n + 1]) - time[n]) / (2.0 * memory))
        direct = np.einsum("n,nr,nw->rw", fade, kernels[:n, 0], areas[:n])
        direct += np.einsum("n,nr,nw->rw", fade, kernels[:n, 1], slants[:n])
        found = fourier_transform.current(fed(GRID, time[: n + 1], signals[: n + 1], memory))
        np.testing.assert_allclose(found, direct, rtol=0, atol=1e-11 * abs(areas[:n]).sum())


@pytest.mark.parametrize("memory", [math.inf, 2.0])
@pytest.mark.parametrize("split", [1, 7, BLOCK, 2 * BLOCK + 3])
def test_many_at_once_are_the_same_bits(memory: float, split: int) -> None:
    time = irregular(3 * BLOCK)
    time[2 * BLOCK - 5 :] += 3.0 * GRID.span  # an interval longer than a block
    signals = np.random.default_rng(5).normal(size=(time.size, 3))
    single = fed(GRID, time, signals, memory)
    many = fourier_transform.start(GRID, 3, memory)
    areas, slants = parts(time, signals)
    for some in (slice(0, split), slice(split, None)):
        begins, ends = time[:-1][some].tolist(), time[1:][some].tolist()
        fourier_transform.add(many, begins, ends, areas[some], slants[some])
    assert fourier_transform.current(single).tobytes() == fourier_transform.current(many).tobytes()


def test_phases_are_right_after_ten_hours() -> None:
    """Twenty seconds of samples that begin 10 h after zero, against sums with phases in extended precision."""
    grid = fourier_transform.lines(0.1, 0.04, 2.0)
    time = 36000.0 + np.arange(4001) * 0.005
    x = np.random.default_rng(6).normal(size=(time.size, 1))
    found = complexes(fourier_transform.current(fed(grid, time, x)))[:, 0]
    middle, h = (0.5 * (time[1:] + time[:-1])).astype(np.longdouble), np.diff(time)
    phase = np.remainder(np.outer(grid.omega.astype(np.longdouble), middle), 2 * np.longdouble(np.pi)).astype(float)
    phi = 0.5 * np.outer(grid.omega, h)
    gain, slope = np.sin(phi) / phi, (np.sin(phi) - phi * np.cos(phi)) / phi**2
    mean, half = 0.5 * (x[1:] + x[:-1])[:, 0], 0.5 * np.diff(x[:, 0])
    direct = (h * np.exp(-1j * phase) * (mean * gain - 1j * half * slope)).sum(axis=1)
    assert abs(found - direct).max() < 1e-9 * abs(direct).max()


@pytest.mark.parametrize("memory", [math.inf, 2.0])
@pytest.mark.parametrize("cut", [BLOCK - 3, 2 * BLOCK + 5])
def test_what_is_taken_out_leaves_what_came_after(memory: float, cut: int) -> None:
    """All up to some time, as it has faded since: what is left is the transform of the rest."""
    time = irregular(4 * BLOCK)
    signals = np.random.default_rng(8).normal(size=(time.size, 3))
    whole = fed(GRID, time, signals, memory)
    before = fourier_transform.current(fed(GRID, time[: cut + 1], signals[: cut + 1], memory))
    fourier_transform.take_out(whole, before * math.exp((time[cut] - time[-1]) / (2.0 * memory)))
    after = fourier_transform.current(fed(GRID, time[cut:], signals[cut:], memory))
    np.testing.assert_allclose(fourier_transform.current(whole), after, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("memory", [math.inf, 2.0])
def test_after_a_restart_nothing_is_left_of_what_was_before(memory: float) -> None:
    time = irregular(3 * BLOCK)
    signals = np.random.default_rng(9).normal(size=(time.size, 3))
    again = fed(GRID, time[:20], signals[:20], memory)
    fourier_transform.restart(again, float(time[20]))
    for (begin, end), (one, other) in zip(pairwise(time[20:].tolist()), pairwise(signals[20:]), strict=True):
        step = end - begin
        area, slant = 0.5 * step * (one + other), 0.5 * step**2 * (other - one)
        fourier_transform.add(again, [begin], [end], area[None], slant[None])
    expected = fourier_transform.current(fed(GRID, time[20:], signals[20:], memory))
    np.testing.assert_allclose(fourier_transform.current(again), expected, rtol=1e-12, atol=1e-14)
