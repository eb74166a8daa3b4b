"""Where the gap lies: by station and axis, by band, by time and by flight regime; and the shape of what is missing."""

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
from sysid_node.gap.thresholds import THRESHOLDS

#: Bins of the missing coefficient's shape.
_BINS = 12

#: Signals that a missing coefficient may depend on, and their units.
REGIMES = {"alpha": "rad", "beta": "rad", "V": "m/s", "thrust": "N", "p": "rad/s", "q": "rad/s", "r": "rad/s"}


@dataclass(frozen=True)
class Shape:
    """The missing coefficient, in bins of the signal that it depends on most."""

    axis: str
    signal: str
    unit: str
    centres: Array
    means: Array
    errors: Array  # standard errors of the means
    explained: float  # share of its variance that the bins explain


def where(attribution: Attribution) -> list[dict[str, Any]]:
    """Shares of the gap by station and axis, adding up to one; the largest first."""
    models = attribution.base.fit.models
    before = [model.residual(model.simulator.neutral()) for model in models]
    flights = list(zip(models, before, strict=True))
    scale = sum((np.abs(v.measured[:, 1:]) ** 2).sum(axis=(0, 1)) for v in models)
    powers = [_power(before), *(_power(r) for r in _steps(attribution.corrected))]
    stations = [*(c.station for c in attribution.chosen.fit.candidates), "aerodynamics"]
    parts: dict[tuple[str, int], float] = {}
    for station, high, low in zip(stations, powers, powers[1:], strict=False):
        for axis, gone in enumerate(np.maximum(high - low, 0.0) / np.maximum(scale, 1e-300)):
            parts[station, axis] = parts.get((station, axis), 0.0) + float(gone)
    remainder = powers[-1] / np.maximum(scale, 1e-300)
    for axis in range(len(CHANNELS)):
        parts["unexplained", axis] = float(remainder[axis] * attribution.structure_left.share[axis])
        parts["noise", axis] = float(remainder[axis] * (1.0 - attribution.structure_left.share[axis]))
    total = sum(parts.values()) or 1.0
    kept = sorted(((k, p / total) for k, p in parts.items() if p > 0.0), key=lambda pair: -pair[1])
    return [{"station": s, "axis": CHANNELS[a], "share": share, **_when(flights, a)} for (s, a), share in kept]


def _steps(fit: CandidateFit) -> list[list[Complex]]:
    """Residuals with the effects added to the file's model in turn, then with the nuisances too."""
    neutral = fit.simulator.neutral()
    partial, steps = [flight.at(neutral.copy()) for flight in fit.flights], []
    for candidate in fit.candidates:
        for flight, fitted in zip(partial, fit.flights, strict=True):
            own = list(candidate.entries)
            flight.point[own] = fitted.point[own]
        steps.append([flight.residual for flight in partial])
    return [*steps, [flight.residual for flight in fit.flights]]


def _power(residuals: Sequence[Complex]) -> Array:
    return np.asarray(sum(power_of(r) for r in residuals))


def _when(flights: Sequence[tuple[ResidualModel, Complex]], axis: int) -> dict[str, Any]:
    """Band, time and regime that hold most of an axis's gap."""
    model, residual = max(flights, key=lambda pair: pair[0].windows.count)
    power = np.abs(residual[:, 1:, axis]) ** 2
    by_line, by_window = power.sum(axis=0), power.sum(axis=1)
    low, high = _smallest(np.bincount(model.windows.bands[1:], by_line, len(BAND_EDGES) - 1).astype(float))
    first, last = _smallest(by_window)
    starts = model.windows.starts
    return {
        "band_hz": [float(BAND_EDGES[low]), float(min(BAND_EDGES[high + 1], model.windows.frequencies[-1]))],
        "regime": _regime(model, by_window),
        "window_s": [float(starts[first]), float(starts[last] + model.windows.length)],
    }


def _smallest(power: Array) -> tuple[int, int]:
    """First and last of the shortest run of bins that holds most of the power."""
    total, sums = power.sum(), np.concatenate([[0.0], np.cumsum(power)])
    for size in range(1, power.size + 1):
        held = sums[size:] - sums[:-size]
        if held.max() >= THRESHOLDS.verdict.most * total:
            return int(held.argmax()), int(held.argmax()) + size - 1
    return 0, power.size - 1


def _regime(model: ResidualModel, by_window: Array) -> dict[str, list[float]]:
    """Range of the signal whose departures go with the gap by window, where one does."""
    best, found = THRESHOLDS.verdict.regime, {}
    for name in _signals(model):
        values = model.record[name]
        pieces = [values[window] for window in model.windows.slices]
        spread = np.array([np.abs(p - values.mean()).max() for p in pieces])
        if model.windows.count < 4 or spread.std() < 1e-12 or by_window.std() < 1e-300:
            continue
        together = float(np.corrcoef(spread, np.sqrt(by_window))[0, 1])
        if together > best:
            piece = pieces[int(by_window.argmax())]
            best, found = together, {name: [float(piece.min()), float(piece.max())]}
    return found


def missing(attribution: Attribution) -> Shape | None:
    """The remainder that derivatives and biases leave, of the coefficient with most structure, against what it depends
    on most; none without structure."""  # fmt: skip
    before = attribution.structure_before
    significant = before.deviations > THRESHOLDS.verdict.shape
    if not significant.any():
        return None
    axis = int(np.argmax(np.where(significant, before.coherent, 0.0)))
    fit = attribution.base.fit
    model = fit.flights[0].model
    remainder = model.series[:, axis] - model.predicted_series(fit.flights[0].point)[:, axis]
    shapes = [_binned(model, name, unit, axis, remainder) for name, unit in _signals(model).items()]
    return max(shapes, key=lambda shape: shape.explained)


def _signals(model: ResidualModel) -> dict[str, str]:
    """Signals of the flight and of its controls that moved, and their units."""
    controls = dict.fromkeys(model.simulator.aircraft.control_symbols, "rad")
    return {n: u for n, u in {**REGIMES, **controls}.items() if n in model.record.columns and model.record[n].std() > 0}


def _binned(model: ResidualModel, name: str, unit: str, axis: int, remainder: Array) -> Shape:
    values = model.record[name]
    edges = np.linspace(float(np.percentile(values, 0.5)), float(np.percentile(values, 99.5)), _BINS + 1)
    inside = (values >= edges[0]) & (values <= edges[-1])
    place = np.clip(np.searchsorted(edges, values[inside], side="right") - 1, 0, _BINS - 1)
    kept = remainder[inside]
    counts = np.bincount(place, minlength=_BINS)
    full = counts > 20
    means = np.bincount(place, kept, _BINS) / np.maximum(counts, 1)
    spread = np.sqrt(np.maximum(np.bincount(place, kept**2, _BINS) / np.maximum(counts, 1) - means**2, 0.0))
    between = float(
        np.sum(counts[full] * (means[full] - kept.mean()) ** 2) / max(float(np.sum((kept - kept.mean()) ** 2)), 1e-300)
    )
    centres = 0.5 * (edges[1:] + edges[:-1])
    independent = np.maximum(
        counts * 4.0 / model.simulator.rate, 1.0
    )  # the remainder keeps its sign for a quarter second
    return Shape(CHANNELS[axis], name, unit, centres[full], means[full], (spread / np.sqrt(independent))[full], between)
