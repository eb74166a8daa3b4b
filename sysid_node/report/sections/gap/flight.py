"""The flight as measured, as simulated with the aircraft file, and as simulated with the correction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.short_flights.readings import READINGS, can_be_simulated, length_of
from sysid_node.gap.validation.handed_on import corrected_parameters
from sysid_node.gap.validation.simulation_error import SideBySide, side_by_side
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import BLUE, PALE, VERMILION, Figure
from sysid_node.report.drawing.thinning import thin_curve
from sysid_node.report.wording.causes import WORDS
from sysid_node.report.wording.names import symbol
from sysid_node.sim.model.layout import OUTPUTS
from sysid_node.sim.prediction.coefficients import COEFFICIENTS

#: Longest part of a flight that is drawn, s: the part with the largest errors of the aircraft file.
_DRAWN = 24.0

#: Ratio of a reading's errors before and after the correction from which it is drawn beside forces and moments.
_MENDED = 1.3

_UNITS = {**dict.fromkeys(("ax", "ay", "az"), "m/s²"), **dict.fromkeys("pqr", "rad/s"), "V": "m/s"}

_UNITS |= dict.fromkeys(("phi", "theta", "alpha", "beta"), "rad")

_GREEK = {"phi": "φ", "theta": "θ", "psi": "ψ", "alpha": "α", "beta": "β"}

Panel = tuple[Any, str, Figure]


def flight(found: Diagnosis) -> Mapping[str, Any]:
    """Measured, with the aircraft file, and corrected: simulated short flights, or else forces and moments."""
    panels = _short_flights(found) if found.simulation_gap else _coefficients(found)
    return {
        "panels": panels,
        "measured_on": found.measured_on,
        "short": bool(found.simulation_gap),
        "window": f"{length_of(found.models[0]):g} s",
    }


def flight_figures(found: Diagnosis) -> list[tuple[str, Figure]]:
    """The flight's figures, each under its symbol and meaning."""
    return [(f"{sign}, {words}", figure) for sign, words, figure in flight(found)["panels"]]


def _short_flights(found: Diagnosis) -> list[Panel]:
    """The readings that moved; each short flight is a separate line."""
    flights = zip(found.models, found.check.corrected.flights, strict=True)
    records = [side_by_side(model, evidence.points) for model, evidence in flights if can_be_simulated(model)]
    return short_flight_panels(most_off(records), list(found.size.per_channel))


def most_off(records: Sequence[SideBySide]) -> SideBySide:
    """The flight with the largest errors of the simulation before the correction, over their size in all flights."""
    columns = [OUTPUTS.index(name) for name in READINGS]
    powers = np.array([((each.before - each.measured)[:, columns] ** 2).mean(axis=0) for each in records])
    return records[int((powers / np.maximum(powers.mean(axis=0), 1e-300)).sum(axis=1).argmax())]


def short_flight_panels(
    record: SideBySide, names: Sequence[str], words: tuple[str, str] = ("file", "corrected")
) -> list[Panel]:
    """Some readings of a flight beside its simulation; ``words`` name the simulation before and after correction."""
    span = _worst(record.time, (record.before - record.measured)[:, [OUTPUTS.index(n) for n in READINGS]])
    begins = record.begins[span].copy()
    panels = []
    for name in names:
        k = OUTPUTS.index(name)
        before, after = (series[span, k].copy() for series in (record.before, record.after))
        before[begins], after[begins] = np.nan, np.nan  # a line ends where the simulator restarts
        panels.append(_panel(name, record.time[span], record.measured[span, k], before, after,
                             _UNITS.get(name, ""), words))  # fmt: skip
    return panels


def _worst(time: Array, error: Array) -> slice:
    """The part of the flight that is drawn: where errors (N, R), over their size in the whole flight, are largest."""
    size = int(np.searchsorted(time - time[0], _DRAWN))
    if size >= time.size:
        return slice(None)
    power = np.cumsum((error**2 / np.maximum((error**2).mean(axis=0), 1e-300)).sum(axis=1))
    first = int(np.argmax(power[size:] - power[:-size]))
    return slice(first, first + size)


def _coefficients(found: Diagnosis) -> list[Panel]:
    """Coefficients without constant offsets, and readings whose errors the correction reduces."""
    model, gaps = found.models[0], found.gap.per_channel
    point = corrected_parameters(found.attribution.corrected, model)
    before, after = model.predicted_series(model.simulator.neutral()), model.predicted_series(point)
    mended = [name in gaps and gaps[name]["before"] > _MENDED * gaps[name]["after"] for name in CHANNELS]
    force = np.arange(len(CHANNELS)) < len(COEFFICIENTS)
    panels = []
    for k in np.flatnonzero(model.axes & (force | mended)):
        shown = [x[:, k] - force[k] * (x[:, k].mean() - model.series[:, k].mean()) for x in (before, after)]
        panels.append(_panel(CHANNELS[k], model.time, model.series[:, k], *shown))
    return panels


def _panel(
    name: str, time: Array, measured: Array, before: Array, after: Array, unit: str = "",
    words: tuple[str, str] = ("file", "corrected"),
) -> Panel:  # fmt: skip
    time, *curves = thin_curve(time, measured, before, after)
    styles = (("measured", PALE, "solid", 4.5), (words[0], VERMILION, "solid", 1.2), (words[1], BLUE, "solid", 1.4))
    traces = [
        figures.line(time, c, n, colour=colour, dash=dash, width=width)
        for c, (n, colour, dash, width) in zip(curves, styles, strict=True)
    ]
    sign = _GREEK.get(name, name)
    layout = {"xaxis": figures.axis("time, s"), "yaxis": figures.axis(f"{sign}, {unit}" if unit else sign)}
    return (
        symbol(name) if name in COEFFICIENTS else sign,
        WORDS[name],
        Figure(f"{WORDS[name]}: measured and simulated", traces, layout),
    )
