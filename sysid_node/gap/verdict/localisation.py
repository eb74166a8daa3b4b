"""Where the gap lies: by station and channel, band, time and flight regime; and the shape of a missing coefficient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import BAND_EDGES, Complex, power_of
from sysid_node.gap.selection.forward_selection import Attribution
from sysid_node.gap.thresholds import THRESHOLDS, Thresholds

#: Bins of the missing coefficient's shape.
_BINS = 12

#: Samples above which a bin is shown, and windows from which on a correlation over windows is computed.
_FEWEST_SAMPLES, _FEWEST_WINDOWS = 20, 4

#: What the corrections leave.
_LEFT = ("unexplained", "noise")

#: Signals that a missing coefficient may depend on, and their units.
REGIMES = {"alpha": "rad", "beta": "rad", "V": "m/s", "thrust": "N", "p": "rad/s", "q": "rad/s", "r": "rad/s"}


@dataclass(frozen=True)
class BinnedCoefficient:
    """The missing coefficient, in bins of the signal that explains most of it."""

    axis: str
    signal: str
    unit: str
    centres: Array  # (B,) of the bins
    means: Array  # (B,) of the coefficient
    errors: Array  # (B,) standard errors of the means
    explained: float  # share of its variance between the bins


def where(attribution: Attribution) -> list[dict[str, Any]]:
    """Shares of the gap by station and channel, adding up to one, the largest first; each with band, time and regime.

    The candidates are added to the aircraft file's model in turn, then the nuisances; what each removes is its share.
    """
    models = attribution.base.fit.models
    before = [model.residual(model.simulator.neutral()) for model in models]
    remaining = [flight.residual for flight in attribution.corrected.flights]
    motion = np.asarray(sum(model.motion_power for model in models))
    powers = [_power(before), *(_power(residuals) for residuals in _residuals_in_turn(attribution.corrected))]
    stations = [*(candidate.station for candidate in attribution.chosen.fit.candidates), "aerodynamics"]
    shares = station_shares(stations, np.array(powers) / np.maximum(motion, 1e-300), attribution.structure_left.share)
    return [
        {"station": s, "axis": CHANNELS[a], "share": share, **_when(models, remaining if s in _LEFT else before, a)}
        for (s, a), share in shares
    ]


def station_shares(stations: Sequence[str], powers: Array, structure: Array) -> list[tuple[tuple[str, int], float]]:
    """Share of the gap of each station and channel, adding up to one, the largest first.

    ``powers`` (1 + stations, channels) are left before each station's part is added and after the last; of the last,
    ``structure`` (channels,) is the share that is unexplained, and the rest is noise.
    """
    parts: dict[tuple[str, int], float] = {}
    for station, high, low in zip(stations, powers, powers[1:], strict=False):
        for axis, removed in enumerate(np.maximum(high - low, 0.0)):
            parts[station, axis] = parts.get((station, axis), 0.0) + float(removed)
    for axis, left in enumerate(powers[-1]):
        parts["unexplained", axis] = float(left * structure[axis])
        parts["noise", axis] = float(left * (1.0 - structure[axis]))
    total = sum(parts.values()) or 1.0
    return sorted(((key, part / total) for key, part in parts.items() if part > 0.0), key=lambda pair: -pair[1])


def _residuals_in_turn(fit: CandidateFit) -> list[list[Complex]]:
    """Residuals of the flights with the candidates added to the file's model in turn, then with the nuisances."""
    neutral = fit.simulator.neutral()
    partial, steps = [flight.at(neutral.copy()) for flight in fit.flights], []
    for candidate in fit.candidates:
        entries = list(candidate.entries)
        for flight, fitted in zip(partial, fit.flights, strict=True):
            flight.point[entries] = fitted.point[entries]
        steps.append([flight.residual for flight in partial])
    return [*steps, [flight.residual for flight in fit.flights]]


def _power(residuals: Sequence[Complex]) -> Array:
    """Power (channels,) of the residuals of several flights."""
    return np.asarray(sum(power_of(residual) for residual in residuals))


def _when(models: Sequence[ResidualModel], residuals: Sequence[Complex], axis: int) -> dict[str, Any]:
    """Band, time and regime that hold most of what a channel's residuals are, on the flight that holds most of it."""
    model, residual = max(zip(models, residuals, strict=True), key=lambda pair: power_of(pair[1])[axis])
    power = np.abs(residual[:, 1:, axis]) ** 2
    by_line, by_window = power.sum(axis=0), power.sum(axis=1)
    low, high = shortest_run(np.bincount(model.windows.bands[1:], by_line, len(BAND_EDGES) - 1).astype(float))
    first, last = shortest_run(by_window)
    starts = model.flight.begin + model.windows.starts
    return {
        "band_hz": [float(BAND_EDGES[low]), float(min(BAND_EDGES[high + 1], model.windows.frequencies[-1]))],
        "regime": regime_of(model, by_window),
        "window_s": [float(starts[first]), float(starts[last] + model.windows.length)],
        "flight": model.record.name,
    }


def shortest_run(power: Array, thresholds: Thresholds = THRESHOLDS) -> tuple[int, int]:
    """First and last index of the shortest run of bins (B,) that holds most of their power; the first of equals."""
    total, sums = power.sum(), np.concatenate([[0.0], np.cumsum(power)])
    for size in range(1, power.size + 1):
        held = sums[size:] - sums[:-size]
        if held.max() >= thresholds.verdict.most * total:
            return int(held.argmax()), int(held.argmax()) + size - 1
    return 0, power.size - 1


def regime_of(model: ResidualModel, by_window: Array, thresholds: Thresholds = THRESHOLDS) -> dict[str, list[float]]:
    """Range, in the worst window, of the signal whose departures by window are most correlated with the gap's (W,).

    Empty where no correlation is above the threshold.
    """
    best, found = thresholds.verdict.regime, dict[str, list[float]]()
    for name in _moving_signals(model):
        values = model.record[name]
        pieces = [values[window] for window in model.windows.slices]
        departures = np.array([np.abs(piece - values.mean()).max() for piece in pieces])
        if model.windows.count < _FEWEST_WINDOWS or departures.std() < 1e-12 or by_window.std() < 1e-300:
            continue
        correlation = float(np.corrcoef(departures, np.sqrt(by_window))[0, 1])
        if correlation > best:
            worst = pieces[int(by_window.argmax())]
            best, found = correlation, {name: [float(worst.min()), float(worst.max())]}
    return found


def missing(attribution: Attribution) -> BinnedCoefficient | None:
    """The shape of the coefficient that is missing most: what derivatives and biases leave of it, structured.

    None where nothing that they leave is structured.
    """
    before = attribution.structure_before
    significant = before.deviations > THRESHOLDS.verdict.shape
    if not significant.any():
        return None
    axis = int(np.argmax(np.where(significant, before.coherent, 0.0)))
    flight = attribution.base.fit.flights[0]
    model = flight.model
    remainder = model.series[:, axis] - model.predicted_series(flight.point)[:, axis]
    rate = model.simulator.rate
    shapes = [
        binned_shape(CHANNELS[axis], name, unit, model.record[name], remainder, rate)
        for name, unit in _moving_signals(model).items()
    ]
    return max(shapes, key=lambda shape: shape.explained)


def _moving_signals(model: ResidualModel) -> dict[str, str]:
    """Signals of the flight and of its controls that moved, and their units."""
    controls = dict.fromkeys(model.simulator.aircraft.control_symbols, "rad")
    return {n: u for n, u in {**REGIMES, **controls}.items() if n in model.record.columns and model.record[n].std() > 0}


def binned_shape(axis: str, signal: str, unit: str, values: Array, remainder: Array, rate: float) -> BinnedCoefficient:
    """A remainder (N,) in bins of a signal's values (N,) at a rate (Hz), without the extremes of the signal.

    Neighbouring samples are not independent: the remainder is taken to keep its sign for a quarter of a second.
    """
    edges = np.linspace(float(np.percentile(values, 0.5)), float(np.percentile(values, 99.5)), _BINS + 1)
    inside = (values >= edges[0]) & (values <= edges[-1])
    bins = np.clip(np.searchsorted(edges, values[inside], side="right") - 1, 0, _BINS - 1)
    kept = remainder[inside]
    counts = np.bincount(bins, minlength=_BINS)
    full = counts > _FEWEST_SAMPLES
    means = np.bincount(bins, kept, _BINS) / np.maximum(counts, 1)
    spread = np.sqrt(np.maximum(np.bincount(bins, kept**2, _BINS) / np.maximum(counts, 1) - means**2, 0.0))
    within = max(float(np.sum((kept - kept.mean()) ** 2)), 1e-300)
    between = float(np.sum(counts[full] * (means[full] - kept.mean()) ** 2) / within)
    centres = 0.5 * (edges[1:] + edges[:-1])
    independent = np.maximum(counts * 4.0 / rate, 1.0)
    return BinnedCoefficient(
        axis, signal, unit, centres[full], means[full], (spread / np.sqrt(independent))[full], between
    )
