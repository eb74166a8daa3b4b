"""What was flown: inputs and motion against time, and the inputs' spectra."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid_node.flight.record import COLUMNS, Array, FlightRecord
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import BLUE, GREEN, PURPLE, VERMILION, Figure
from sysid_node.report.drawing.thinning import thin_curve
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.results.signals import Spectra
from sysid_node.report.sections.section import Section

DEGREES = 180.0 / np.pi


@dataclass(frozen=True)
class Group:
    """Signals that share one plot: column -> label, drawn in ``unit`` = SI times ``scale``."""

    title: str
    unit: str
    scale: float
    columns: Mapping[str, str]


GROUPS = (
    Group("Flow angles", "deg", DEGREES, {"alpha": "\u03b1", "beta": "\u03b2"}),
    Group("Angular rates", "deg/s", DEGREES, {"p": "p, roll", "q": "q, pitch", "r": "r, yaw"}),
    Group("Airspeed", "m/s", 1.0, {"V": "V"}),
    Group("Specific force", "m/s\u00b2", 1.0, {"ax": "forward", "ay": "right", "az": "down"}),
    Group("Attitude", "deg", DEGREES, {"phi": "\u03c6, roll", "theta": "\u03b8, pitch"}),
    Group("Thrust", "N", 1.0, {"thrust": "thrust"}),
)

#: One colour and dash for each axis of motion: pitch, roll, yaw; all other signals have a common one.
_STYLE = {
    **dict.fromkeys(("de", "alpha", "q", "theta", "az"), (BLUE, "solid")),
    **dict.fromkeys(("da", "p", "phi"), (VERMILION, "solid")),
    **dict.fromkeys(("dr", "beta", "r", "ay"), (GREEN, "solid")),
    **dict.fromkeys(("V", "thrust"), (BLUE, "solid")),
}
_OTHER_STYLE = (PURPLE, "dash")

_SURFACES = {"de": "elevator", "da": "aileron", "dr": "rudder"}


def context(run: RunResult) -> Mapping[str, Any]:
    """Captions and figures, the deflections first."""
    spectrum = None if run.signals.spectra is None or not run.signals.spectra.inputs else _spectrum(run.signals.spectra)
    return {"plots": figures_of(run), "spectrum": spectrum}


def figures_of(run: RunResult) -> list[tuple[str, Figure]]:
    """Titles and figures of inputs and motion; none without the recorded signals."""
    return [] if run.signals.flight is None else histories(run.signals.flight)


def histories(flight: FlightRecord) -> list[tuple[str, Figure]]:
    """Titles and figures: the deflections against time, then the motion."""
    surfaces = {c: _SURFACES.get(c, c) for c in flight.columns if c in _SURFACES or c not in COLUMNS}
    groups = (Group("Control deflections", "deg", DEGREES, surfaces), *GROUPS)
    return [(group.title, figure) for group in groups if (figure := _history(flight, group)) is not None]


def _history(flight: FlightRecord, group: Group) -> Figure | None:
    measured = [column for column in group.columns if flight.measured(column)]
    if not measured:
        return None
    traces = [
        _line(column, group.columns[column], *thin_curve(flight.time, group.scale * flight[column]))
        for column in measured
    ]
    layout = {
        "xaxis": figures.axis("time, s"),
        "yaxis": figures.axis(group.unit),
        "showlegend": len(traces) > 1,
    }
    names = ", ".join(group.columns[column] for column in measured)
    return Figure(f"{group.title} against time in {group.unit}: {names}", traces, layout)


def _line(column: str, label: str, x: Array, y: Array) -> figures.Trace:
    colour, dash = _STYLE.get(column, _OTHER_STYLE)
    return figures.line(x, y, label, colour=colour, dash=dash, width=1.3)


def _spectrum(spectra: Spectra) -> Figure:
    traces = [
        _line(name, _SURFACES.get(name, name), spectra.frequency, DEGREES * values)
        for name, values in spectra.inputs.items()
        if name != "thrust"
    ]
    layout = {
        "xaxis": figures.axis("frequency, Hz"),
        "yaxis": figures.axis("amplitude, deg", rangemode="tozero"),
        "showlegend": len(traces) > 1,
    }
    return Figure("Amplitude spectra of the control deflections, deg against Hz", traces, layout, height=260)


SECTION: Section[RunResult] = Section("excitation", "What was flown", "excitation.html.j2", context)
