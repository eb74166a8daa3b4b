"""The page of ``sysid excite``: a manoeuvre, its predicted standard errors, and its predicted flight."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sysid_node.report.drawing.spectrum import amplitude_spectrum
from sysid_node.report.pages.render import render_page
from sysid_node.report.results.manoeuvre_result import ManoeuvreResult
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.results.signals import RunSignals, Spectra
from sysid_node.report.sections import excitation
from sysid_node.report.sections.manoeuvre import correlations, plan, prediction
from sysid_node.report.sections.section import Section

#: Lines of the drawn spectra, Hz.
_FREQUENCIES = np.arange(0.05, 5.0, 0.05)


def write_manoeuvre_report(path: Path, result: ManoeuvreResult) -> None:
    """Write the page as one HTML file."""
    path.write_text(render_page(f"Manoeuvre for {result.aircraft.name}", SECTIONS, result), encoding="utf-8")


def _run(result: ManoeuvreResult) -> RunResult:
    """The predicted flight as a run without estimates, for the sections that draw flights."""
    flight = result.prediction.flight
    symbols = result.aircraft.control_symbols
    spectrum = amplitude_spectrum(flight.time, np.column_stack([flight[s] for s in symbols]), _FREQUENCIES)
    spectra = Spectra(_FREQUENCIES, inputs=dict(zip(symbols, spectrum.T, strict=True)))
    return RunResult(result.aircraft.name, "excite", (), signals=RunSignals(flight, spectra))


SECTIONS: tuple[Section[ManoeuvreResult], ...] = (
    Section("opening", "", "manoeuvre/opening.html.j2", plan.opening),
    Section("manoeuvre", "The manoeuvre", "manoeuvre/plan.html.j2", plan.context),
    Section("prediction", "Predicted standard errors", "manoeuvre/prediction.html.j2", prediction.context),
    Section("correlations", "Correlated derivatives", "manoeuvre/correlations.html.j2", correlations.context),
    Section("excitation", "Predicted flight", "excitation.html.j2", lambda result: excitation.context(_run(result))),
)
