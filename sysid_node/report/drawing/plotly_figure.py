"""The report's figures as one figure of Plotly, for notebooks. Plotly is imported only here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sysid_node.report.drawing.figures import Figure, Trace, unpacked

if TYPE_CHECKING:
    from plotly import graph_objects

Titled = tuple[str, Figure]

#: Shares of the width and of a row's height that are left between panels.
_BETWEEN, _ABOVE = 0.07, 0.28


def plotly_figure(panels: Sequence[Titled], columns: int) -> graph_objects.Figure:
    """Panels side by side, each under its title. Raises ImportError where Plotly is not installed."""
    from plotly import graph_objects  # noqa: PLC0415

    columns = min(columns, len(panels)) or 1
    rows = math.ceil(len(panels) / columns)
    layout: dict[str, Any] = {"shapes": [], "annotations": [], "margin": {"t": 50}}
    traces: list[Trace] = []
    for place, (title, figure) in enumerate(panels):
        number = "" if place == 0 else str(place + 1)
        left, right, bottom, top = _domain(place, rows, columns)
        x, y = (dict(figure.layout.get(f"{axis}axis", {})) for axis in "xy")
        layout[f"xaxis{number}"] = x | {"domain": [left, right], "anchor": f"y{number}"}
        layout[f"yaxis{number}"] = y | {"domain": [bottom, top], "anchor": f"x{number}"}
        layout["annotations"].append(_heading(title, left, top))
        layout["shapes"] += [_placed(shape, number) for shape in figure.layout.get("shapes", ())]
        explained = len(_names(figure)) > 1 and (place == 0 or _names(figure) != _names(panels[0][1]))
        layout[f"legend{number}"] = _legend(figure, right, top)
        traces += [_on_axes(trace, number, explained) for trace in figure.traces]
    layout["height"] = 60 + sum(max(f.height for _, f in panels[r * columns : (r + 1) * columns]) for r in range(rows))
    layout["showlegend"] = any(trace.get("name") for trace in traces)
    style = {key: value for key, value in panels[0][1].spec["layout"].items() if key not in layout} if panels else {}
    return graph_objects.Figure({"data": traces, "layout": style | layout})


def _domain(place: int, rows: int, columns: int) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of a panel, as shares of the figure."""
    width, height = (1.0 - _BETWEEN * (columns - 1)) / columns, 1.0 / rows
    left, top = place % columns * (width + _BETWEEN), 1.0 - place // columns * height
    return left, left + width, max(top - height * (1.0 - _ABOVE), 0.0), top


def _names(figure: Figure) -> list[str]:
    """The names of the lines."""
    return [trace["name"] for trace in figure.traces if trace.get("name")]


def _legend(figure: Figure, right: float, top: float) -> dict[str, Any]:
    """A legend above a panel, at its right."""
    return {**figure.spec["layout"]["legend"], "x": right, "xanchor": "right", "y": top, "yanchor": "bottom"}


def _on_axes(trace: Trace, number: str, explained: bool) -> Trace:
    """The trace on its panel's axes; its name stands in the panel's legend where that is ``explained``."""
    named = {"showlegend": explained, "legend": f"legend{number}"} if trace.get("name") else {}
    arrays = {axis: unpacked(trace[axis]) for axis in "xy" if isinstance(trace[axis], Mapping)}
    return {**trace, **arrays, "xaxis": f"x{number}", "yaxis": f"y{number}", **named}


def _heading(title: str, left: float, top: float) -> dict[str, Any]:
    place = {"x": left, "y": top, "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "bottom"}
    return {"text": title, "showarrow": False, "font": {"size": 13}, **place}


def _placed(shape: Mapping[str, Any], number: str) -> dict[str, Any]:
    """A line or an area on its panel's axes; one that spanned the whole plot spans the panel."""
    return {**shape, **{f"{axis}ref": _reference(axis, number, shape.get(f"{axis}ref", axis)) for axis in "xy"}}


def _reference(axis: str, number: str, before: str) -> str:
    return f"{axis}{number} domain" if before == "paper" else f"{axis}{number}"
