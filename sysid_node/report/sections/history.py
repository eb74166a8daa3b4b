"""Every estimate against time with its 95 % interval, one panel per derivative."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from sysid_node.flight.record import Array
from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import Figure, Mask
from sysid_node.report.drawing.thinning import thin_curve
from sysid_node.report.results.comparison import changes, half_width
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections.groups import grouped
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.names import short_meaning, symbol, unit
from sysid_node.report.wording.numbers import with_interval

POINTS = 900  # of one panel's curves


@dataclass(frozen=True)
class HistoryPanel:
    """A panel with its caption; without a figure if no estimate was ever finite."""

    name: str
    symbol: Markup
    meaning: str
    valid: bool
    status: str
    figure: Figure | None


@dataclass(frozen=True)
class _Curves:
    """One derivative over time, each (N,)."""

    time: Array
    value: Array
    lower: Array
    upper: Array
    valid: Array  # 1.0 or 0.0


def context(run: RunResult) -> Mapping[str, Any]:
    """Groups of panels; none if there is only one time."""
    if run.final is None or len(run.history) < 2:
        return {"groups": []}
    final = run.final.derivatives
    groups = [(title, [_panel(run, final[name]) for name in names]) for title, names in grouped(final)]
    return {
        "groups": groups,
        "has_prior": bool(run.references.prior),
        "has_truth": bool(run.references.truth),
        "has_changes": any(changes(run.history, name) for name in final),
    }


def figures_of(run: RunResult) -> list[tuple[str, Figure]]:
    """Each panel's figure under the derivative's name; none if there is only one time."""
    panels = [panel for _, group in context(run)["groups"] for panel in group]
    return [(panel.name, panel.figure) for panel in panels if panel.figure]


def _panel(run: RunResult, last: DerivativeEstimate) -> HistoryPanel:
    curves = _curves(run, last.name)
    figure = _figure(run, last, curves) if np.isfinite(curves.value).any() else None
    status = "valid" if last.valid and last.status == "ok" else last.status
    return HistoryPanel(last.name, symbol(last.name), short_meaning(last.name), last.valid, status, figure)


def _curves(run: RunResult, name: str) -> _Curves:
    found = [(e.time, d) for e in run.history if (d := e.derivatives.get(name)) is not None]
    table = np.array([(time, d.value, d.lower, d.upper, d.valid) for time, d in found], dtype=np.float64)
    return _Curves(*thin_curve(*table.T, points=POINTS))


def _figure(run: RunResult, last: DerivativeEstimate, c: _Curves) -> Figure:
    valid = c.valid > 0.5
    muted = _touching(~valid)
    traces = [
        figures.band(c.time, c.lower, c.upper, muted, figures.GREY_BAND),
        figures.band(c.time, c.lower, c.upper, valid, figures.BLUE_BAND),
        figures.line(c.time, np.where(muted, c.value, np.nan), colour=figures.MUTED, width=1.2),
        figures.line(c.time, np.where(valid, c.value, np.nan)),
    ]
    layout = {
        "xaxis": figures.axis("time, s", range=[min(run.history[0].time, 0.0), run.history[-1].time]),
        "yaxis": figures.axis(unit(last.name), range=_limits(run, last.name, c)),
        "shapes": _references(run, last.name) + [figures.moment(time) for time in changes(run.history, last.name)],
    }
    ends = f"ends at {with_interval(last.value, half_width(last))} {unit(last.name)}, {last.status}"
    return Figure(f"{last.name} against time with its 95 % interval; {ends}", traces, layout, height=200)


def _touching(mask: Mask) -> Mask:
    """The mask widened by one sample on both sides, so that two lines meet where validity changes."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    return wide


def _references(run: RunResult, name: str) -> list[dict[str, Any]]:
    shapes = []
    if name in run.references.prior:
        shapes.append(figures.level(run.references.prior[name].value, figures.MUTED, "dash"))
    if name in run.references.truth:
        since = run.references.truth_since.get(name)
        span = None if since is None else (since, run.history[-1].time)
        shapes.append(figures.level(run.references.truth[name], figures.VERMILION, span=span))
    return shapes


def _limits(run: RunResult, name: str, c: _Curves) -> list[float]:
    """Axis limits around the later estimates; the wide intervals of the first seconds are cut off."""
    progress = (c.time - c.time[0]) / max(c.time[-1] - c.time[0], 1e-9)
    shown = (progress >= 0.25) & (c.valid > 0.5)
    if not shown.any():
        shown = progress >= 0.6
    wanted = [*_percentiles(c.value[shown], 1, 99), *_percentiles(c.lower[shown], 15, 85)]
    wanted += [*_percentiles(c.upper[shown], 15, 85), c.lower[-1], c.upper[-1], c.value[-1]]
    wanted += [run.references.truth[name]] if name in run.references.truth else []
    wanted += [run.references.prior[name].value] if name in run.references.prior else []
    finite = [float(value) for value in wanted if np.isfinite(value)]
    if not finite:
        finite = c.value[np.isfinite(c.value)].tolist()
    low, high = min(finite), max(finite)
    margin = 0.12 * (high - low) or 0.1 * abs(high) or 0.1
    return [low - margin, high + margin]


def _percentiles(values: Array, low: float, high: float) -> list[float]:
    known = values[np.isfinite(values)]
    return [float(p) for p in np.percentile(known, [low, high])] if known.size else []


SECTION: Section[RunResult] = Section("history", "Estimates against time", "history.html.j2", context)
