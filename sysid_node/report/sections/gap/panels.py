"""The gap: how far off by reading, where by station and axis, against time, by candidate, and the shape of what is
missing."""  # fmt: skip

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import document
from sysid_node.gap.estimation.predictive_density import transferred_parameters
from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.gap.validation.simulation_error import READINGS, WINDOW, can_be_simulated, side_by_side
from sysid_node.gap.validation.spectral_error import STAGES
from sysid_node.gap.verdict.decision import structured_channels
from sysid_node.gap.verdict.localisation import REGIMES
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import BLUE, GREEN, INK, MUTED, PALE, PURPLE, VERMILION, Figure
from sysid_node.report.drawing.thinning import thin_curve
from sysid_node.report.sections.gap.paragraph import WORDS, paragraph, percent, units_of
from sysid_node.report.wording.names import REGRESSOR_WORDS, symbol, words_of
from sysid_node.report.wording.numbers import NONE, likely, number, with_interval
from sysid_node.sim.model.layout import OUTPUTS
from sysid_node.sim.model.prediction import COEFFICIENTS

#: Flight that is drawn at most, s: where the simulator of the file is furthest off.
_DRAWN = 24.0

#: Steps of the waterfall before the rest.
_STEPS = 7

#: How much smaller the error of a reading must have become for it to be drawn beside forces and moments.
_MENDED = 1.3

#: Of a gap's errors.
_STAGE_WORDS = ("Gap before", "Within tolerances", "Gap after", "Noise floor")

_UNITS = {**dict.fromkeys(("ax", "ay", "az"), "m/s²"), **dict.fromkeys("pqr", "rad/s"), "V": "m/s"}
_GREEK = {"phi": "φ", "theta": "θ", "psi": "ψ", "alpha": "α", "beta": "β"}
_UNITS |= dict.fromkeys(("phi", "theta", "alpha", "beta"), "rad")

_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, "#E69F00", "#56B4E9", "#CC79A7", "#999999")


def opening(found: Diagnosis) -> Mapping[str, Any]:
    """The paragraph and the figures beside it."""
    gap = found.size
    low, high = gap.ci95
    facts = [
        ("Verdict", words_of(found.verdict)),
        *((words, percent(getattr(gap, stage))) for words, stage in zip(_STAGE_WORDS, STAGES, strict=True)),
        ("Closed", f"{number(gap.shrink_percent, 3)} % ({number(low, 3)} to {number(high, 3)})"),
    ]
    return {
        "text": paragraph(found),
        "facts": facts,
        "next_flight": found.next_flight,
        "short": bool(found.simulation_gap),
        "window": f"{WINDOW:g} s" if found.simulation_gap else f"{found.models[0].windows.length:.2g} s",
    }


def where(found: Diagnosis) -> Mapping[str, Any]:
    """The waterfall by station and axis, and a table of the largest steps."""
    rows = [
        (w["station"], WORDS[w["axis"]], percent(w["share"]),
         "{} to {} Hz".format(*(number(x, 2) for x in w["band_hz"])),
         "{} to {} s".format(*(number(x, 3) for x in w["window_s"])),
         ", ".join(_span(name, *ends) for name, ends in w["regime"].items()))
        for w in found.where[:8]
    ]  # fmt: skip
    return {"figure": waterfall(found), "rows": rows, "unknown": found.verdict == "unknown_effect"}


def _span(name: str, low: float, high: float) -> str:
    """``roll rate −1.1 to 1.8 rad/s``."""
    return f"{_signal(name)} {number(low, 2)} to {number(high, 2)} {REGIMES.get(name, 'rad')}"


def _signal(name: str) -> str:
    """A signal of the flight, or a control, in words."""
    return WORDS.get(name) or REGRESSOR_WORDS.get(name, name)


def waterfall(found: Diagnosis) -> Figure:
    """From all of the gap down to what noise leaves."""
    steps = _steps_down(found)
    stations = list(dict.fromkeys(station for station, _, _ in steps))
    colours = dict(zip(stations, _COLOURS, strict=False)) | {"noise": MUTED, "unexplained": INK}
    traces, left = [], 100.0
    for station, words, share in steps:
        left -= share
        traces.append(
            {
                "type": "bar",
                "x": [words],
                "y": [share],
                "base": [max(left, 0.0)],
                "text": [percent(share / 100.0)],
                "textposition": "outside",
                "cliponaxis": False,
                "marker": {"color": colours.get(station, MUTED)},
                "hovertemplate": f"{station}, %{{x}}: %{{y:.1f}} %<extra></extra>",
            }
        )
    layout = {
        "barmode": "overlay",
        "xaxis": figures.axis("", type="category", tickangle=0, nticks=0),
        "yaxis": figures.axis("of the gap's power, %", range=[0, 112]),
    }
    return Figure("The gap by station and axis, down to what noise leaves", traces, layout, 340)


def _steps_down(found: Diagnosis) -> list[tuple[str, str, float]]:
    """Station, label and percentage of each step: the largest by axis, the rest of all, then noise."""
    caused = [w for w in found.where if w["station"] != "noise"]
    steps = [(w["station"], f"{w['station']}<br>{WORDS[w['axis']]}", 100.0 * w["share"]) for w in caused[:_STEPS]]
    rest = 100.0 * sum(w["share"] for w in caused[_STEPS:])
    noise = 100.0 * sum(w["share"] for w in found.where if w["station"] == "noise")
    return [*steps, *([("the rest", "the rest", rest)] if rest > 0.0 else []), ("noise", "noise", noise)]


def flight(found: Diagnosis) -> Mapping[str, Any]:
    """Measured, as the file has it, and as corrected: short flights where there are any, else forces and moments."""
    panels = _short_flights(found) if found.simulation_gap else _coefficients(found)
    return {
        "panels": panels,
        "held_out": found.held_out,
        "short": bool(found.simulation_gap),
        "window": f"{WINDOW:g} s",
    }


Panel = tuple[Any, str, Figure]


def flight_figures(found: Diagnosis) -> list[tuple[str, Figure]]:
    """The flight's figures, each under its symbol and meaning."""
    return [(f"{sign}, {words}", figure) for sign, words, figure in flight(found)["panels"]]


def _short_flights(found: Diagnosis) -> list[Panel]:
    """The readings that moved, each short flight a line of its own."""
    place = next(k for k, model in enumerate(found.models) if can_be_simulated(model))
    record = side_by_side(found.models[place], found.check.final.flights[place].points)
    span = _worst(record.time, (record.before - record.measured)[:, [OUTPUTS.index(n) for n in READINGS]])
    begins = record.begins[span].copy()
    panels = []
    for name in found.size.per_channel:
        k = OUTPUTS.index(name)
        before, after = (series[span, k].copy() for series in (record.before, record.after))
        before[begins], after[begins] = np.nan, np.nan  # a line ends where the simulator begins anew
        panels.append(_panel(name, record.time[span], record.measured[span, k], before, after, _UNITS.get(name, "")))
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
    """Coefficients, constant offsets removed, and readings that the causes mend."""
    model, gaps = found.models[0], found.gap.per_channel
    point = transferred_parameters(found.attribution.corrected, model)
    before, after = model.predicted_series(model.simulator.neutral()), model.predicted_series(point)
    mended = [name in gaps and gaps[name]["before"] > _MENDED * gaps[name]["after"] for name in CHANNELS]
    force = np.arange(len(CHANNELS)) < len(COEFFICIENTS)
    panels = []
    for k in np.flatnonzero(model.axes & (force | mended)):
        shown = [x[:, k] - force[k] * (x[:, k].mean() - model.series[:, k].mean()) for x in (before, after)]
        panels.append(_panel(CHANNELS[k], model.record.time, model.series[:, k], *shown))
    return panels


def _panel(name: str, time: Array, measured: Array, before: Array, after: Array, unit: str = "") -> Panel:
    time, *curves = thin_curve(time, measured, before, after)
    styles = (("measured", PALE, "solid", 4.5), ("file", VERMILION, "solid", 1.2), ("corrected", BLUE, "solid", 1.4))
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


def candidates(found: Diagnosis) -> Mapping[str, Any]:
    """Every effect that was fitted to the end, alone; and the causes with their parameters."""
    said = document(found)
    rows = [
        (words_of(c["effect"]), NONE if c["probability"] is None else likely(c["probability"]),
         f"{100 * c['share']:.1f}", 100 * c["share"])
        for c in said["candidates"]
    ]  # fmt: skip
    doubted = [_doubted(c) for c in said["doubted"]]
    causes = [
        {
            "name": words_of(c["label"]),
            "station": c["station"],
            "probability": likely(c["probability"]),
            "parameters": _parameters(c),
            "rivals": ", ".join(words_of(r) for r in c["indistinguishable_from"]),
        }
        for c in said["causes"]
    ]
    return {"rows": rows, "causes": causes, "doubted": ", ".join(doubted), "confusion": _confusion(found)}


def _doubted(cause: Mapping[str, Any]) -> str:
    """``actuator lag (probability 0.42; time constant 0.110 ± 0.006 s)``."""
    said = [f"probability {likely(cause['probability'])}", *map(" ".join, _parameters(cause))]
    return f"{words_of(cause['label'])} ({'; '.join(said)})"


def _parameters(cause: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value with its 95 % interval, and unit of each of a cause's parameters."""
    units = units_of(cause["effect"])
    return [(words_of(n), with_interval(v, 1.96 * e), units.get(n, "")) for n, (v, e) in cause["parameters"].items()]


def _confusion(found: Diagnosis) -> Mapping[str, Any]:
    """Cells of the map of what is confused with what."""
    table = found.confusion
    cells = [
        {"row": i, "column": j, "value": number(value, 2), "opacity": f"{abs(value):.2f}", "positive": value > 0}
        for i, row in enumerate(table.cosines.tolist())
        for j, value in enumerate(row)
        if j < i and abs(value) >= 0.05
    ]
    return {"names": [words_of(label) for label in table.labels], "cells": cells}


def channels(found: Diagnosis) -> Mapping[str, Any]:
    """The gap of each channel before and after, beside its noise floor, and of all together with its intervals."""
    gap = found.size
    rows = [(WORDS[name], *(percent(c[stage]) for stage in STAGES)) for name, c in gap.per_channel.items()]
    whole = ("all together", *(percent(getattr(gap, stage)) for stage in STAGES))
    ends = ("95 % interval", *(_between(gap.intervals[stage]) for stage in STAGES))
    return {
        "rows": rows,
        "whole": [whole, ends],
        "held_out": found.held_out,
        "short": bool(found.simulation_gap),
        "window": f"{WINDOW:g} s",
    }


def _between(ends: tuple[float, float]) -> str:
    """``12 to 15 %``."""
    return f"{number(100.0 * ends[0], 2)} to {percent(ends[1])}"


def shape(found: Diagnosis) -> Mapping[str, Any]:
    """The missing coefficient against what it depends on most."""
    missing = found.shape
    if missing is None:
        return {"figure": None, "words": "", "left": bool(structured_channels(found.scores).any())}
    signal = _signal(missing.signal)
    trace = figures.line(missing.centres, missing.means, missing.axis)
    trace |= {"mode": "lines+markers", "error_y": {"type": "data", "array": (1.96 * missing.errors).tolist()}}
    layout = {
        "xaxis": figures.axis(f"{signal}, {missing.unit}"),
        "yaxis": figures.axis(f"missing {missing.axis}"),
    }
    words = f"The missing {WORDS[missing.axis]} against {signal}"
    return {
        "figure": Figure(words, [trace], layout, 300),
        "words": f"{words}; the bins explain {number(100 * missing.explained, 2)} % of it",
        "left": bool(structured_channels(found.scores).any()),
    }
