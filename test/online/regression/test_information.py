"""Lines of a finite record: their noise covariance, what is projected out, and independence of the grid."""

import math
from dataclasses import fields

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import fly, made_aircraft, multisteps

from sysid_node.online.frequency import fourier_transform
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import information
from sysid_node.online.regression.information import BANDS
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings

Array = NDArray[np.float64]
GRID = fourier_transform.lines(0.1, 0.1, 2.0)
WIDTH, OUTPUT, REGRESSOR = OFFSET + 5, 0, OFFSET + 3


def transformed(time: Array, signals: Array, memory: float = math.inf) -> Array:
    """(2F + 1, W) transform of signals (N, W) on straight lines between the samples."""
    state = fourier_transform.start(GRID, signals.shape[1], memory)
    steps = np.diff(time)
    areas = 0.5 * steps[:, None] * (signals[1:] + signals[:-1])
    slants = 0.5 * steps[:, None] ** 2 * (signals[1:] - signals[:-1])
    fourier_transform.add(state, time[:-1].tolist(), time[1:].tolist(), areas, slants)
    return fourier_transform.current(state)


def record(seed: int, begin: float = 2.0, end: float = 12.0) -> tuple[Array, Array]:
    """Times, and random signals with the nuisances k (varying), 1 and t in their columns."""
    rng = np.random.default_rng(seed)
    time = np.arange(begin, end + 0.005, 0.01)
    signals = rng.normal(size=(time.size, WIDTH)).cumsum(axis=0) * 0.05
    signals[:, OFFSET] = 1.0 + 0.1 * np.sin(2.1 * time + seed)
    signals[:, OFFSET + 1], signals[:, OFFSET + 2] = 1.0, time
    return time, signals


@pytest.mark.parametrize("memory", [math.inf, 4.0])
def test_noise_covariance_is_that_of_transformed_white_noise(memory: float) -> None:
    """2000 records of white noise of unit density against the closed form; its diagonal is about half the energy."""
    time = np.arange(1.0, 9.001, 0.02)
    noise = np.random.default_rng(1).normal(size=(time.size, 2000)) / math.sqrt(0.02)
    lines = transformed(time, noise, memory)[:-1]
    spectrum = information.spectrum(GRID.omega, memory)
    expected = information.noise_covariance(spectrum, time[0], time[-1])
    scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    error = (lines @ lines.T / 2000 - expected) / scale
    assert np.abs(error).max() < 5.0 / math.sqrt(2000)  # five standard deviations of a sample covariance
    assert np.sqrt(np.mean(error**2)) < 1.2 / math.sqrt(2000)
    half = 0.5 * information.window_energy(8.0, spectrum.rate)
    assert expected.diagonal().mean() == pytest.approx(half, rel=0.05)


def test_window_energy() -> None:
    t = np.linspace(0.0, 7.0, 100_001)
    assert information.window_energy(7.0, 0.0) == 7.0
    assert information.window_energy(7.0, 0.3) == pytest.approx(np.trapezoid(np.exp(-0.3 * t), t), rel=1e-8)


def test_an_offset_of_the_coefficient_leaves_nothing() -> None:
    """C_0 enters as k C_0, with k varying: exactly gone, whatever its size."""
    time, signals = record(2)
    shifted = signals.copy()
    shifted[:, OUTPUT] += 40.0 * signals[:, OFFSET]
    clean = [information.clean_lines(transformed(time, x), None) for x in (signals, shifted)]
    np.testing.assert_allclose(clean[0], clean[1], rtol=0, atol=1e-9)


def test_a_constant_and_a_drift_leave_nothing() -> None:
    time, signals = record(3)
    signals[:, OFFSET] = 1.0
    drifting = signals.copy()
    drifting[:, REGRESSOR] += 3.0 - 0.5 * time
    clean = [information.clean_lines(transformed(time, x), None) for x in (signals, drifting)]
    np.testing.assert_allclose(clean[0], clean[1], rtol=0, atol=1e-9)


def test_a_late_drift_is_taken_out_as_well_as_an_early_one() -> None:
    """After ten hours the time itself is large, its course over the segment is not."""
    for begin in (0.0, 36000.0):
        time, signals = record(3, begin, begin + 2.0)
        signals[:, OFFSET] = 1.0
        signals[:, REGRESSOR] = 3.0 - 0.5 * (time - begin)
        clean = information.clean_lines(transformed(time, signals), None)
        assert np.abs(clean[:, REGRESSOR]).max() < 1e-5


def test_lines_about_the_mean_do_not_depend_on_how_transforms_lie() -> None:
    time, signals = record(5)
    lines = transformed(time, signals)
    laid = [np.array(lines, order=order) for order in ("C", "F")]
    by_line, by_signal = (information.about_mean(transform, None) for transform in laid)
    np.testing.assert_allclose(by_line, by_signal, rtol=1e-12, atol=1e-12)
    share = lines[-1] / lines[-1, OFFSET]
    share[OFFSET : OFFSET + 3] = 0.0
    np.testing.assert_allclose(by_signal, lines[:-1] - lines[:-1, [OFFSET]] * share, rtol=1e-12, atol=1e-12)


def test_projection_keeps_the_nuisances_and_is_orthogonal_to_them() -> None:
    time, signals = record(4)
    lines = information.about_mean(transformed(time, signals), None)
    clean = information.project(lines)
    nuisances = lines[:, OFFSET + 1 : OFFSET + 3]
    np.testing.assert_array_equal(clean[:, OFFSET + 1 : OFFSET + 3], nuisances)
    others = np.delete(clean, [OFFSET + 1, OFFSET + 2], axis=1)
    scale = np.outer(np.linalg.norm(nuisances, axis=0), np.linalg.norm(lines[:, :OFFSET], axis=0)).max()
    assert np.abs(nuisances.T @ others).max() < 1e-9 * scale


def test_segments_add_up_to_least_squares_on_all_their_lines() -> None:
    """Sums of Gram matrices against numpy.linalg.lstsq on the stacked lines."""
    spectrum = information.spectrum(GRID.omega, math.inf)
    total, stacked = None, []
    for seed in range(3):
        time, signals = record(seed, 10.0 * seed, 10.0 * seed + 8.0)
        lines = transformed(time, signals)
        info = information.measure(lines, None, spectrum, time[0], time[-1])
        total = info if total is None else total + info
        stacked.append(information.clean_lines(lines, None))
    assert total is not None
    A, y = np.vstack(stacked)[:, REGRESSOR:], np.vstack(stacked)[:, OUTPUT]
    gram = total.grams.sum(axis=0)
    found = np.linalg.solve(gram[REGRESSOR:, REGRESSOR:], gram[REGRESSOR:, OUTPUT])
    np.testing.assert_allclose(found, np.linalg.lstsq(A, y)[0], rtol=1e-9)
    assert total.energy == pytest.approx(24.0)


def test_scores_and_traces_are_the_moments_of_white_noise() -> None:
    """Noise of unit density as an output: E[(A'e)(A'e)'] = scores; E[e'e] = traces, nuisances taken out."""
    time, signals = record(5)
    spectrum = information.spectrum(GRID.omega, math.inf)
    lines = transformed(time, signals)
    info = information.measure(lines, None, spectrum, time[0], time[-1])
    covariance = information.noise_covariance(spectrum, time[0], time[-1])
    A = information.clean_lines(lines, None)[:, REGRESSOR:]
    scores = info.scores.sum(axis=0)[REGRESSOR:, REGRESSOR:]
    np.testing.assert_allclose(scores, A.T @ covariance @ A, rtol=1e-9)
    n = transformed(time, signals)[:-1, OFFSET + 1 : OFFSET + 3]
    away = np.eye(len(n)) - n @ np.linalg.solve(n.T @ n, n.T)
    assert info.traces.sum() == pytest.approx(np.trace(away @ covariance), rel=1e-9)
    assert info.trace_square == pytest.approx(np.linalg.norm(covariance) ** 2, rel=1e-12)


def test_fading_scales_everything() -> None:
    time, signals = record(6)
    info = information.measure(
        transformed(time, signals), None, information.spectrum(GRID.omega, math.inf), time[0], time[-1]
    )
    half, double = info.scaled(0.5), info + info
    for field in fields(info):
        if field.name == "noise_moments":
            continue  # sums of its own
        np.testing.assert_allclose(4.0 * getattr(half, field.name), getattr(double, field.name))


@pytest.mark.parametrize("count", [1, 2, 5, 6, 7, 48])
def test_bands_hold_every_line_once(count: int) -> None:
    omega = 2 * np.pi * (0.1 + 0.04 * np.arange(count))
    bands = information.spectrum(omega, math.inf).bands
    assert len(bands) == BANDS
    assert np.concatenate([np.arange(count)[band] for band in bands]).tolist() == list(range(count))


@pytest.mark.parametrize("method", ["sls_rft", "iv_rft"])
def test_neither_estimates_nor_errors_depend_on_how_dense_the_grid_is(method: str) -> None:
    """0.1:0.04:1.5 Hz and 0.1:0.01:1.5 Hz of the same 30 s records: four times the lines, no more information.

    Where lines were taken for independent, standard errors would halve.
    """
    aircraft = made_aircraft()
    time, samples = fly(aircraft, multisteps(30.0, 100.0), flights=1, gusts=0.7)
    ratios, moves = [], []
    for flight in samples:
        coarse, fine = (
            run(aircraft, OnlineSettings(frequencies=(0.1, step, 1.5), method=method), time, flight, time[-1:])[
                0
            ].derivatives
            for step in (0.04, 0.01)
        )
        slopes = [name for name in coarse if not name.endswith("_0")]
        ratios.append([fine[n].standard_error / coarse[n].standard_error for n in slopes])
        moves.append([(fine[n].value - coarse[n].value) / coarse[n].standard_error for n in slopes])
    assert np.median(ratios) == pytest.approx(1.0, abs=0.06)
    assert np.abs(np.median(ratios, axis=0) - 1.0).max() < 0.25
    assert np.sqrt(np.mean(np.square(moves))) < 0.6
