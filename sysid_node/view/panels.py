"""Panels and lanes of what every flight has: its motion, its controls, and estimates against time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from sysid_node.flight.record import COLUMNS, Array, FlightRecord
from sysid_node.online.types import Estimates
from sysid_node.report.results.run_result import References
from sysid_node.report.wording.names import short_meaning
from sysid_node.view.scene import (
    BLUE,
    GREEN,
    GREY,
    NOTHING,
    PALE,
    PURPLE,
    SKY,
    VERMILION,
    Lane,
    LaneChange,
    Note,
    PlotCurve,
    PlotPanel,
)

DEGREES = 180.0 / np.pi

SURFACES = {"de": "elevator", "da": "aileron", "dr": "rudder"}

#: Title of a panel of motion, its unit, factor from SI, and its columns with their names.
MOTION = (
    ("Flow angles", "deg", DEGREES, {"alpha": "angle of attack", "beta": "sideslip"}),
    ("Rates", "deg/s", DEGREES, {"p": "roll rate", "q": "pitch rate", "r": "yaw rate"}),
    ("Attitude", "deg", DEGREES, {"phi": "roll", "theta": "pitch"}),
    ("Airspeed", "m/s", 1.0, {"V": "airspeed"}),
    ("Specific force", "m/s²", 1.0, {"ax": "forward", "ay": "right", "az": "down"}),
    ("Thrust", "N", 1.0, {"thrust": "thrust"}),
)

#: A control moves where it covers this share of its whole range within so many seconds.
MOVING_SHARE, _WITHIN = 0.15, 1.5

#: Share of the window that is taken off a move again; the rest keeps a single step visible.
_EDGES = 0.85

_COLOURS = (BLUE, VERMILION, GREEN, PURPLE)


def motion_panels(record: FlightRecord) -> list[PlotPanel]:
    """Deflections, then the motion, of the columns that were measured."""
    surfaces = {c: SURFACES.get(c, c) for c in record.columns if c in SURFACES or c not in COLUMNS}
    groups = (("Controls", "deg", DEGREES, surfaces), *MOTION)
    panels = []
    for title, unit, factor, columns in groups:
        measured = [c for c in columns if record.measured(c)]
        curves = [
            PlotCurve(columns[c], record.time, factor * record[c], colour)
            for c, colour in zip(measured, _COLOURS * 3, strict=False)
        ]
        panels += [PlotPanel(title, unit, curves)] if curves else []
    return panels


def control_lanes(record: FlightRecord) -> list[Lane]:
    """When each control moves: it covers a share of its range within 1.5 s."""
    lanes = []
    for column in (c for c in record.columns if c in SURFACES or c not in COLUMNS):
        if record.measured(column):
            name = SURFACES.get(column, column)
            lanes.append(Lane(name, moving(record.time, record[column], "moves")))
    return lanes


def moving(time: Array, values: Array, state: str) -> list[LaneChange]:
    """The changes between ``state`` and none, of values (N,) at times (N,) that cover a share of their range."""
    known = np.isfinite(values)
    time, values = time[known], values[known]
    whole = float(np.ptp(values)) if values.size else 0.0
    if values.size < 2 or not whole > 0.0:
        return [LaneChange(float(time[0]) if time.size else 0.0, NOTHING)]
    size = max(round(_WITHIN / float(np.median(np.diff(time)))), 2)
    near = (maximum_filter1d(values, size) - minimum_filter1d(values, size)) > MOVING_SHARE * whole
    moves = minimum_filter1d(near, round(_EDGES * size))  # a window reaches out by half its length at either end
    edges = np.flatnonzero(np.diff(moves.astype(np.int8), prepend=0))
    changes = [LaneChange(float(time[i]), state if moves[i] else NOTHING) for i in edges]
    return changes if changes and changes[0].time == time[0] else [LaneChange(float(time[0]), NOTHING), *changes]


def derivative_tabs(
    history: Sequence[Estimates], references: References, names: Iterable[str] = ()
) -> dict[str, list[PlotPanel]]:
    """A tab of panels for each half of the model: estimates with their 95 % intervals, the file's value, the truth.

    ``names``: the derivatives; by default those that were estimated.
    """
    names = list(names) or list(dict.fromkeys(name for e in history for name in e.derivatives))
    tabs: dict[str, list[PlotPanel]] = {}
    for name in names:
        tab = "Pitch" if name.partition("_")[0] in ("CL", "CD", "Cm") else "Roll and yaw"
        tabs.setdefault(f"Derivatives, {tab.lower()}", []).append(derivative_panel(name, history, references))
    return tabs


def derivative_panel(name: str, history: Sequence[Estimates], references: References) -> PlotPanel:
    """One derivative against time."""
    rows = [(e.time, e.derivatives[name]) for e in history if name in e.derivatives]
    time = np.array([t for t, _ in rows])
    value, lower, upper = (np.array([getattr(d, key) for _, d in rows]) for key in ("value", "lower", "upper"))
    valid = np.array([d.valid for _, d in rows], dtype=bool)
    curves = [
        PlotCurve("not valid", time, np.where(valid, np.nan, value), PALE, 1.5),
        PlotCurve("lower 95 %", time, lower, SKY, 1.0),
        PlotCurve("upper 95 %", time, upper, SKY, 1.0),
        PlotCurve("estimate", time, np.where(valid, value, np.nan), BLUE, 2.5),
        *_reference_curves(name, time, references),
    ]
    return PlotPanel(name, short_meaning(name), curves, _span(value, lower, upper, valid, name, references))


def estimate_notes(history: Sequence[Estimates]) -> list[Note]:
    """When each derivative became valid for the first time, and when it was found to have changed."""
    notes, seen, before = [], set[str](), dict[str, str]()
    for estimates in history:
        for name, d in estimates.derivatives.items():
            if d.valid and name not in seen:
                seen.add(name)
                notes.append(Note(estimates.time, f"{name} valid: {d.value:.4g} ({d.lower:.4g} to {d.upper:.4g})"))
            if d.status.startswith("changed") and not before.get(name, "").startswith("changed"):
                notes.append(Note(estimates.time, f"{name} has changed and is estimated anew", "WARN"))
            before[name] = d.status
    return notes


def _reference_curves(name: str, time: Array, references: References) -> list[PlotCurve]:
    """The file's value and the truth, as lines over the estimates' time."""
    ends, curves = time[[0, -1]] if time.size else np.zeros(2), []
    if name in references.prior:
        curves.append(PlotCurve("aircraft file", ends, np.full(2, references.prior[name].value), VERMILION, 1.0))
    if name in references.truth:
        since = references.truth_since.get(name)
        begin = ends if since is None else np.array([since, max(since, ends[1])])
        curves.append(PlotCurve("true", begin, np.full(2, references.truth[name]), GREEN, 1.5))
    return curves


def _span(
    value: Array, lower: Array, upper: Array, valid: Array, name: str, references: References
) -> tuple[float, float] | None:
    """The range that shows the valid estimates and what they are compared with; early intervals are far wider.

    Without a valid estimate it is the file's value with four times its tolerance at either side.
    """
    known = [references.prior[name].value] if name in references.prior else []
    known += [references.truth[name]] if name in references.truth else []
    shown = valid & np.isfinite(value)
    if not shown.any():
        tolerance = references.prior[name].tolerance if name in references.prior else math.nan
        return None if not known or math.isnan(tolerance) else (known[0] - 4.0 * tolerance, known[0] + 4.0 * tolerance)
    last = int(np.flatnonzero(shown)[-1])
    half = 0.5 * float(upper[last] - lower[last])
    ends = np.array([*value[shown], *known, value[last] - 4.0 * half, value[last] + 4.0 * half])
    low, high = float(np.nanmin(ends)), float(np.nanmax(ends))
    margin = 0.08 * (high - low) or 0.1 * max(abs(high), 1e-6)
    return low - margin, high + margin


def residual_panels(responses: Mapping[str, tuple[Array, Array, Array]], titles: Mapping[str, str]) -> list[PlotPanel]:
    """Measured and modelled coefficients or readings, and their difference: name -> time, measured, modelled (N,)."""
    return [
        PlotPanel(titles.get(name, name), "", [
            PlotCurve("measured", time, measured, GREY, 2.5),
            PlotCurve("modelled", time, modelled, BLUE, 1.5),
            PlotCurve("measured minus modelled", time, measured - modelled, VERMILION, 1.0),
        ])
        for name, (time, measured, modelled) in responses.items()
    ]  # fmt: skip
