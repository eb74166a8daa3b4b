"""Plotly figures as plain values: one style, arrays packed as 32-bit floats.

The page needs plotly.js only (its basic bundle lies in ``templates/vendor``); nothing here imports Plotly.
Colours are Okabe and Ito's (2008), told apart by colour-blind readers and in grey print by dashes.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from sysid_node.flight.record import Array

BLUE, VERMILION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#AA4499"
INK, MUTED, PALE, GRID = "#1f2933", "#8a94a0", "#bcc5cf", "#e6eaef"
BLUE_BAND, GREY_BAND = "rgba(0,114,178,0.20)", "rgba(138,148,160,0.20)"

Trace = dict[str, Any]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Figure:
    """One plot: Plotly traces and layout, a sentence for readers who cannot see it, its height in pixels."""

    label: str
    traces: Sequence[Trace]
    layout: Mapping[str, Any] = field(default_factory=dict)
    height: int = 230

    @property
    def spec(self) -> dict[str, Any]:
        """The figure as Plotly takes it: ``data`` and ``layout``."""
        return {"data": list(self.traces), "layout": {**_LAYOUT, "height": self.height, **self.layout}}

    @property
    def json(self) -> Markup:
        """The figure for a ``<script type="application/json">``: nothing in it can end that element."""
        text = json.dumps(self.spec, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        return Markup(text.replace("<", "\\u003c"))


def packed(values: Array) -> dict[str, str]:
    """An array (N,) as Plotly's typed-array text; NaN is a gap in the line."""
    data = np.ascontiguousarray(values, dtype="<f4").tobytes()
    return {"dtype": "f4", "bdata": base64.b64encode(data).decode("ascii")}


def unpacked(values: Mapping[str, str]) -> NDArray[np.float32]:
    """The array (N,) that ``packed`` made into text."""
    return np.frombuffer(base64.b64decode(values["bdata"]), dtype="<f4")


def line(x: Array, y: Array, name: str = "", *, colour: str = BLUE, dash: str = "solid", width: float = 1.6) -> Trace:
    """A line through (N,) points; the hover text names it."""
    return {
        "type": "scatter",
        "mode": "lines" if x.size > 1 else "markers",
        "x": packed(x),
        "y": packed(y),
        "name": name,
        "line": {"color": colour, "dash": dash, "width": width},
        "marker": {"color": colour, "size": 7},
        "hovertemplate": "%{y:.4~g}",
    }


def band(x: Array, lower: Array, upper: Array, keep: Mask, colour: str) -> Trace:
    """The area between two (N,) curves wherever ``keep`` (N,) holds and both are finite, one polygon a stretch."""
    inside = (keep & np.isfinite(lower) & np.isfinite(upper)).astype(np.int8)
    edges = np.flatnonzero(np.diff(inside, prepend=0, append=0))
    xs: list[Array] = []
    ys: list[Array] = []
    gap = np.array([np.nan])
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        stretch = slice(start, stop)
        xs += [x[stretch], x[stretch][::-1], gap]
        ys += [upper[stretch], lower[stretch][::-1], gap]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": packed(np.concatenate(xs) if xs else np.empty(0)),
        "y": packed(np.concatenate(ys) if ys else np.empty(0)),
        "fill": "toself",
        "fillcolor": colour,
        "line": {"width": 0},
        "hoverinfo": "skip",
    }


def level(
    value: float, colour: str, dash: str = "solid", width: float = 1.4, span: tuple[float, float] | None = None
) -> dict[str, Any]:
    """A horizontal line across the plot, or over a ``span`` of times (s)."""
    begin, end = span or (0, 1)
    position = {"type": "line", "xref": "x" if span else "paper", "x0": begin, "x1": end, "y0": value, "y1": value}
    return {**position, "line": {"color": colour, "dash": dash, "width": width}}


def moment(time: float, colour: str = INK) -> dict[str, Any]:
    """A dotted vertical line at a time (s)."""
    position = {"type": "line", "yref": "paper", "y0": 0, "y1": 1, "x0": time, "x1": time}
    return {**position, "line": {"color": colour, "dash": "dot", "width": 1.2}}


def stretch(begin: float, end: float) -> dict[str, Any]:
    """The background between two times (s)."""
    position = {"type": "rect", "yref": "paper", "y0": 0, "y1": 1, "x0": begin, "x1": end}
    return {**position, "fillcolor": GREY_BAND, "line": {"width": 0}, "layer": "below"}


def axis(title: str, **more: Any) -> dict[str, Any]:
    """An axis with its quantity and unit."""
    return {**_AXIS, "title": {"text": title, "standoff": 6, "font": {"size": 12}}, **more}


_AXIS: dict[str, Any] = {
    "gridcolor": GRID,
    "zeroline": False,
    "linecolor": "#b8c0ca",
    "showline": True,
    "ticks": "outside",
    "ticklen": 3,
    "tickcolor": "#b8c0ca",
    "nticks": 6,
    "automargin": True,
    "exponentformat": "none",
}

_LAYOUT: dict[str, Any] = {
    "font": {"family": "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', sans-serif", "size": 12, "color": INK},
    "margin": {"l": 54, "r": 10, "t": 10, "b": 40},
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "showlegend": False,
    "hovermode": "x",
    "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yanchor": "bottom", "font": {"size": 12}},
    "separators": ".\u202f",
}
