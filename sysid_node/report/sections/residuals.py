"""The spectra of the residuals: what the model does not explain, by frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import Figure
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.results.signals import Spectra
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.names import COEFFICIENT_WORDS, symbol


def context(run: RunResult) -> Mapping[str, Any]:
    """One panel per coefficient: its residual, and the coefficient where it is known."""
    spectra = run.signals.spectra
    names = () if spectra is None else tuple(spectra.residuals)
    return {
        "panels": [(symbol(n), n, COEFFICIENT_WORDS.get(n, ""), _figure(spectra, n)) for n in names if spectra],
        "has_measured": spectra is not None and bool(spectra.measured),
    }


def figures_of(run: RunResult) -> list[tuple[str, Figure]]:
    """The residual's spectrum under the name of each coefficient."""
    spectra = run.signals.spectra
    return [(name, _figure(spectra, name)) for name in (spectra.residuals if spectra else ())] if spectra else []


def _figure(spectra: Spectra, name: str) -> Figure:
    traces = []
    if name in spectra.measured:
        measured = spectra.measured[name]
        traces.append(figures.line(spectra.frequency, measured, "measured", colour=figures.MUTED, width=1.2))
    traces.append(figures.line(spectra.frequency, spectra.residuals[name], "residual", colour=figures.VERMILION))
    layout = {
        "xaxis": figures.axis("frequency, Hz"),
        "yaxis": figures.axis("amplitude", rangemode="tozero"),
    }
    return Figure(f"Amplitude spectrum of the residual of {name}", traces, layout, height=200)


SECTION: Section[RunResult] = Section("residuals", "Residuals", "residuals.html.j2", context)
