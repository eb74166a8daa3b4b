"""The information of the present segment, and of the finished ones."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.fourier_transform import impulse
from sysid_node.online.regression import heteroskedasticity, information, regressor_noise
from sysid_node.online.regression.information import Information
from sysid_node.online.state import EstimatorState
from sysid_node.online.systematic import cross_spectra

Array = NDArray[np.float64]
RECENT = 8  # pieces over which the mean motion is taken, about which noise moments are measured


def measure_noise_moments(state: EstimatorState) -> None:
    """Add the moments of the heteroskedastic noise since the last time that they were measured."""
    now, segment = state.transform.last, state.segment
    duration = now - segment.noise_measured_until
    if duration <= 0.0 or not state.transform.recent:
        return
    pieces, every = list(state.changes.monitor.pieces)[-RECENT:], segment.intervals / max(segment.samples, 1)
    # about the mean of the last seconds, as slower motion is not in the lines
    mean = np.sum([piece[-1] for _, piece in pieces], axis=0) / (now - pieces[0][0])
    model, rows = state.model, np.concatenate(state.transform.recent)
    boxes = max(round(2.0 * model.settings.frequencies[2] * duration), 1)
    found = heteroskedasticity.measure(
        model.aircraft, model.layout, model.equations, model.prior[0], rows, mean, duration, every, boxes
    )
    segment.noise_moments = segment.noise_moments + found
    segment.noise_measured_until = now
    state.transform.recent.clear()


def measure_segment(state: EstimatorState, lines: Array) -> Information:
    """The information of the present segment up to the last sample."""
    model, segment = state.model, state.segment
    begin, end = segment.start, state.transform.last
    info = information_of(state, lines, begin, end)
    samples = max(segment.samples, 1)
    mean = info.integrals / information.window_energy(end - begin, 0.5 * model.spectrum.rate)
    per_line_second = regressor_noise.gram_bias(
        model.aircraft, model.layout, mean, (end - begin) / samples, segment.intervals / samples
    )
    info.bias = line_seconds(state, info) * per_line_second
    info.samples, info.noise_moments = float(segment.samples), segment.noise_moments
    segment.information = info
    return info


def information_of(state: EstimatorState, lines: Array, begin: float, end: float) -> Information:
    """The information in the transform ``lines`` of begin..end (s), with cross-spectra where not all is exact."""
    model, layout = state.model, state.model.layout
    if model.imperfections is None:
        clean = information.clean_lines(lines, state.controls.line_model)
        return information.measure_clean(clean, lines[-1], model.spectrum, begin, end)
    edges = information.edges(*(impulse(model.spectrum.omega, time) for time in (begin, end)))
    clean = information.clean_lines_and_rates(
        lines, state.controls.line_model, edges, model.spectrum.omega, layout.differentiated
    )
    info = information.measure_clean(clean[:, : layout.width], lines[-1], model.spectrum, begin, end, edges)
    info.spectra = cross_spectra.cross_spectra(np.delete(clean, np.s_[layout.transformed : layout.width], axis=1))
    return info


def line_seconds(state: EstimatorState, info: Information) -> float:
    """Lines times seconds over which noise counts; the nuisances take one line."""
    return max((state.model.spectrum.omega.size - 1) * info.energy, 1e-9)


def no_information(state: EstimatorState) -> Information:
    """No information at all."""
    return information.nothing(state.model.layout, state.finished.information.spectra.shape[0])


def finished_information(state: EstimatorState) -> Information:
    """Sum of the finished segments, faded to now, without those that the window has left behind."""
    now, window, rate = state.transform.last, state.model.settings.window, state.model.spectrum.rate
    finished = state.finished
    if rate and finished.information.samples:
        finished.information = finished.information.scaled(math.exp(-rate * (now - finished.time)))
    finished.time = now
    left = len(finished.in_window)
    while window and finished.in_window and finished.in_window[0][0] <= now - window:
        finished.in_window.popleft()
    if len(finished.in_window) < left:
        finished.information = sum((info for _, info in finished.in_window), no_information(state))
    return finished.information


def fading(state: EstimatorState, since: float) -> float:
    """Share of a transform's amplitude that is left of what was there at ``since`` (s)."""
    return math.exp(0.5 * state.model.spectrum.rate * (since - state.transform.last))
