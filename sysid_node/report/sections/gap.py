"""The gap in words, by station and axis, against time, by candidate, and as the shape of what is missing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import document
from sysid_node.gap.evidence import carried
from sysid_node.gap.verdict import structured
from sysid_node.gap.view import CHANNELS
from sysid_node.report import figures
from sysid_node.report.figures import BLUE, GREEN, MUTED, PURPLE, VERMILION, Figure
from sysid_node.report.thin import thin_curve
from sysid_node.report.words import COEFFICIENT_WORDS, number, symbol, with_interval, words_of
from sysid_node.sim import EFFECTS
from sysid_node.sim.layout import Layout
from sysid_node.sim.prediction import COEFFICIENTS

#: What is compared, in words.
_WORDS = {
    **COEFFICIENT_WORDS,
    "V": "airspeed",
    "alpha": "angle of attack",
    "beta": "sideslip",
    "phi": "roll angle",
    "theta": "pitch angle",
    "psi": "heading",
}

#: Motion of the air that is not worth a word, m/s rms.
_STILL = 0.2

#: How much smaller the error of a reading must have become for it to be drawn.
_MENDED = 1.3

#: Of a channel's gap: as the file has it, with derivatives and biases fitted, with the causes, noise.
_STAGES = ("before", "tolerances", "after", "noise_floor")

_OTHERS = ("#E69F00", "#56B4E9", "#CC79A7", "#999999")


def paragraph(found: Diagnosis) -> str:
    """What was found, for a pilot."""
    return _findings(found) + _weather(found)


def _weather(found: Diagnosis) -> str:
    """How much the air moved, where it did."""
    if found.air_motion < _STILL:
        return ""
    return (
        f" The air was not still: across the flight path it moved by {number(found.air_motion, 2)} m/s (root mean "
        "square), which is taken as weather, not as the aircraft's doing."
    )


def _findings(found: Diagnosis) -> str:
    gap = found.gap
    worst = max(gap.per_channel, key=lambda c: gap.per_channel[c]["before"], default="")
    off = f"The simulator's {_WORDS.get(worst, 'response')} is {_percent(gap, worst)} off"
    whose = "flight held out" if found.held_out else "parts of the flight that were not fitted"
    falls = (
        f"on {whose} the error over all channels falls from {number(gap.before, 2)} to {number(gap.after, 2)} of the "
        f"motion, {number(gap.shrink_percent, 3)} % of what could be closed; noise alone would leave "
        f"{number(gap.noise_floor, 2)}"
        if gap.after < 0.95 * gap.before
        else f"on {whose} the error over all channels is {number(gap.before, 2)} of the motion"
    )
    if found.verdict == "no_gap":
        return (
            f"{off}, no more than noise and the aircraft file's tolerances allow: with the derivatives fitted within "
            f"these, {falls}. No other effect is needed."
        )
    if found.verdict == "unsupported":
        return f"{off}, but the flight moves too little to say why: fly a larger manoeuvre."
    if not found.attribution.causes:
        return (
            f"{off}, by more than noise and tolerances allow, and none of the effects known here predicts it: {falls}."
        )
    causes = " and ".join(_cause_words(cause) for cause in document(found)["causes"])
    doubt = {
        "ambiguous": " This flight does not settle which.",
        "unknown_effect": " Much remains that no effect known here predicts.",
    }.get(found.verdict, "")
    return f"{off}. The flight says: {causes}. With that added, {falls}.{doubt}"


def _percent(gap: Any, channel: str) -> str:
    share = gap.per_channel[channel]["before"] if channel else gap.before
    return f"{number(100 * share, 2)} %"


def _cause_words(cause: Mapping[str, Any]) -> str:
    """``actuator lag (time constant 0.110 ± 0.006 s, probability 0.98)``."""
    units = _units(cause["effect"])
    shown = [
        f"{words_of(name)} {with_interval(value, 1.96 * error)} {units.get(name, '')}".strip()
        for name, (value, error) in cause["parameters"].items()
        if abs(value) > 2.0 * error
    ]
    rivals = cause["indistinguishable_from"]
    beside = f"; or {', '.join(words_of(r) for r in rivals)}" if rivals else ""
    sure = f"probability {number(cause['probability'], 2)}"
    return f"{words_of(cause['label'])} ({'; '.join([*shown[:4], sure])}{beside})"


def _units(effect: str) -> dict[str, str]:
    """Units of the parameters of an effect, where they do not depend on the aircraft."""
    layout = Layout(("elevator", "aileron", "rudder"), ("de", "da", "dr"), ())
    return {p.name: "" if p.unit == "1" else p.unit for p in EFFECTS[effect].parameters(layout)}


def opening(found: Diagnosis) -> Mapping[str, Any]:
    """The paragraph and the figures beside it."""
    gap = found.gap
    low, high = gap.ci95
    facts = [
        ("Verdict", words_of(found.verdict)),
        ("Gap before", number(gap.before, 3)),
        ("within tolerances", number(gap.tolerances, 3)),
        ("Gap after", number(gap.after, 3)),
        ("Noise floor", number(gap.noise_floor, 3)),
        ("Closed", f"{number(gap.shrink_percent, 3)} % ({number(low, 3)} to {number(high, 3)})"),
        ("Windows", f"{number(found.views[0].windows.length, 2)} s"),
    ]
    return {"text": paragraph(found), "facts": facts, "next_flight": found.next_flight}


def where(found: Diagnosis) -> Mapping[str, Any]:
    """Shares by station, stacked by axis; and a table of the largest."""
    stations = list(dict.fromkeys(w["station"] for w in found.where))
    colours = (BLUE, VERMILION, GREEN, PURPLE, *_OTHERS)
    traces = []
    for station, colour in zip(stations, colours, strict=False):
        shares = {w["axis"]: 100.0 * w["share"] for w in found.where if w["station"] == station}
        traces.append(
            {
                "type": "bar",
                "name": station,
                "x": list(CHANNELS),
                "y": [shares.get(c, 0.0) for c in CHANNELS],
                "marker": {"color": MUTED if station == "noise" else colour},
            }
        )
    layout = {
        "barmode": "stack",
        "showlegend": True,
        "xaxis": figures.axis("channel", dtick=1),
        "yaxis": figures.axis("share of the gap, %", rangemode="tozero"),
    }
    rows = [
        (w["station"], symbol(w["axis"]), f"{number(100 * w['share'], 2)} %",
         "{} to {} Hz".format(*(number(x, 2) for x in w["band_hz"])),
         "{} to {} s".format(*(number(x, 3) for x in w["window_s"])),
         ", ".join(f"{n} {number(a, 2)} to {number(b, 2)}" for n, (a, b) in w["regime"].items()))
        for w in found.where[:8]
    ]  # fmt: skip
    return {"figure": Figure("Shares of the gap by station and coefficient", traces, layout, 320), "rows": rows}


def flight(found: Diagnosis) -> Mapping[str, Any]:
    """The coefficients, and readings that the causes mend, as measured, as the file has them, and as corrected."""
    view = found.views[0]
    fit = found.attribution.corrected
    neutral = view.simulator.neutral()
    point = carried(fit, view)
    before, after = view.predicted_series(neutral), view.predicted_series(point)
    panels = []
    gaps = found.gap.per_channel
    mended = [name in gaps and gaps[name]["before"] > _MENDED * gaps[name]["after"] for name in CHANNELS]
    force = np.arange(len(CHANNELS)) < len(COEFFICIENTS)
    for k in np.flatnonzero(view.axes & (force | mended)):
        offset = [float(x[:, k].mean() - view.series[:, k].mean()) if force[k] else 0.0 for x in (before, after)]
        time, *curves = thin_curve(
            view.record.time, view.series[:, k], before[:, k] - offset[0], after[:, k] - offset[1]
        )
        styles = (("measured", MUTED, "solid"), ("file", VERMILION, "dot"), ("corrected", BLUE, "solid"))
        traces = [
            figures.line(time, c, n, colour=colour, dash=dash, width=1.3)
            for c, (n, colour, dash) in zip(curves, styles, strict=True)
        ]
        layout = {"xaxis": figures.axis("time, s"), "yaxis": figures.axis(CHANNELS[k])}
        words = _WORDS[CHANNELS[k]]
        panels.append((symbol(CHANNELS[k]), words, Figure(f"{words}: measured and simulated", traces, layout)))
    return {"panels": panels, "held_out": found.held_out}


def candidates(found: Diagnosis) -> Mapping[str, Any]:
    """Every effect that was fitted to the end, alone; and the causes with their parameters."""
    rows = [(words_of(label), f"{100 * p:.1f}", 100 * p) for label, p in found.attribution.table]
    causes = [
        {
            "name": words_of(c["label"]),
            "station": c["station"],
            "probability": number(c["probability"], 2),
            "parameters": [
                (words_of(n), with_interval(v, 1.96 * e), _units(c["effect"]).get(n, ""))
                for n, (v, e) in c["parameters"].items()
            ],
            "rivals": ", ".join(words_of(r) for r in c["indistinguishable_from"]),
        }
        for c in document(found)["causes"]
    ]
    return {"rows": rows, "causes": causes, "confusion": _confusion(found)}


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
    """The gap of each channel before and after, beside its noise floor."""
    rows = [
        (_WORDS[name], *(f"{number(100.0 * c[stage], 2)} %" for stage in _STAGES))
        for name, c in found.gap.per_channel.items()
    ]
    return {"rows": rows, "held_out": found.held_out}


def shape(found: Diagnosis) -> Mapping[str, Any]:
    """The missing coefficient against what it depends on most."""
    missing = found.shape
    if missing is None:
        return {"figure": None, "words": "", "left": structured(found.attribution)}
    trace = figures.line(missing.centres, missing.means, missing.axis)
    trace |= {"mode": "lines+markers", "error_y": {"type": "data", "array": (1.96 * missing.errors).tolist()}}
    layout = {
        "xaxis": figures.axis(f"{missing.signal}, {missing.unit}"),
        "yaxis": figures.axis(f"missing {missing.axis}"),
    }
    words = f"The missing {_WORDS[missing.axis]} against {missing.signal}"
    return {
        "figure": Figure(words, [trace], layout, 300),
        "words": f"{words}; the bins explain {number(100 * missing.explained, 2)} % of it",
        "left": structured(found.attribution),
    }
