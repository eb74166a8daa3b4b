"""Where the gap lies: by station and axis, from the whole down to the noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.verdict.localisation import REGIMES
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import BLUE, GREEN, INK, MUTED, PURPLE, VERMILION, Figure
from sysid_node.report.wording.causes import WORDS, percent, signal_words
from sysid_node.report.wording.numbers import number

#: Steps of the waterfall before the rest.
_STEPS = 7

#: Share of the gap's power from which a step is drawn by itself.
_LEAST = 0.0005

#: Height of a step, pixels: two lines of text and a gap.
_ROW = 38

_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, "#E69F00", "#56B4E9", "#CC79A7", "#999999")


def where(found: Diagnosis) -> Mapping[str, Any]:
    """The waterfall by station and axis, and a table of the largest steps."""
    names = dict.fromkeys(w["flight"] for w in found.where)
    several = len(names) > 1
    rows = [
        (w["station"], WORDS[w["axis"]], percent(w["share"]),
         "{} to {} Hz".format(*(number(x, 2) for x in w["band_hz"])),
         "{} to {} s".format(*(number(x, 3) for x in w["window_s"])) + (f" of {w['flight']}" if several else ""),
         ", ".join(_span(name, *ends) for name, ends in w["regime"].items()))
        for w in found.where[:8]
    ]  # fmt: skip
    flight = "" if several else next(iter(names), "")
    return {"figure": waterfall(found), "rows": rows, "unknown": found.verdict == "unknown_effect", "flight": flight}


def _span(name: str, low: float, high: float) -> str:
    """``roll rate −1.1 to 1.8 rad/s``."""
    return f"{signal_words(name)} {number(low, 2)} to {number(high, 2)} {REGIMES.get(name, 'rad')}"


def waterfall(found: Diagnosis) -> Figure:
    """A waterfall from the whole gap down to the noise."""
    steps = _steps_down(found)
    stations = list(dict.fromkeys(station for station, _, _ in steps))
    colours = dict(zip(stations, _COLOURS, strict=False)) | {"noise": MUTED, "unexplained": INK}
    traces, left = [], 100.0
    for station, words, share in steps:
        left -= share
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "y": [words],
                "x": [share],
                "base": [max(left, 0.0)],
                "text": [percent(share / 100.0)],
                "textposition": "outside",
                "cliponaxis": False,
                "marker": {"color": colours.get(station, MUTED)},
                "hovertemplate": "%{y}: %{x:.1f} %<extra></extra>",
            }
        )
    layout = {
        "barmode": "overlay",
        "xaxis": figures.axis("of the gap's power, %", range=[0, 116]),
        "yaxis": figures.axis("", type="category", autorange="reversed", nticks=0),
    }
    height = 60 + _ROW * len(traces)
    return Figure("The gap by station and axis, down to what noise leaves", traces, layout, height)


def _steps_down(found: Diagnosis) -> list[tuple[str, str, float]]:
    """Station, label and percentage of each step: the largest by axis, the rest of all, then noise."""
    caused = [w for w in found.where if w["station"] != "noise"]
    drawn = [w for w in caused if w["share"] >= _LEAST][:_STEPS]
    # Two lines a label: beside their bars they leave room for these on a phone, too.
    labels = [f"{w['station']},<br>{WORDS[w['axis']]}" for w in drawn]
    steps = [(w["station"], label, 100.0 * w["share"]) for w, label in zip(drawn, labels, strict=True)]
    rest = 100.0 * sum(w["share"] for w in caused if w not in drawn)
    noise = 100.0 * sum(w["share"] for w in found.where if w["station"] == "noise")
    return [*steps, *([("the rest", "the rest", rest)] if rest >= 100.0 * _LEAST else []), ("noise", "noise", noise)]
