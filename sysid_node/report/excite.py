"""The page of ``sysid excite``: a manoeuvre, the flight that it gives, and what it would tell about the aircraft."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.excite.optimise import Envelope, Optimum
from sysid_node.excite.prediction import Prediction
from sysid_node.report.data import RunResult, Spectra
from sysid_node.report.page import render_page
from sysid_node.report.sections import Section, correlations, excitation, manoeuvre, prediction
from sysid_node.report.spectrum import amplitude_spectrum

#: Lines of the drawn spectra, Hz.
_FREQUENCIES = np.arange(0.05, 5.0, 0.05)


@dataclass(frozen=True)
class ExciteResult:
    """A manoeuvre with what it predicts; ``optimum`` where it was shaped."""

    aircraft: Aircraft
    prediction: Prediction
    envelope: Envelope
    autopilot: bool
    optimum: Optimum | None = None


def write_excite_report(path: Path, result: ExciteResult) -> None:
    """The page as one HTML file."""
    path.write_text(render_page(f"Manoeuvre for {result.aircraft.name}", SECTIONS, result), encoding="utf-8")


def _run(result: ExciteResult) -> RunResult:
    """The predicted flight as a run without estimates, for the sections that draw flights."""
    flight = result.prediction.flight
    symbols = result.aircraft.control_symbols
    spectrum = amplitude_spectrum(flight.time, np.column_stack([flight[s] for s in symbols]), _FREQUENCIES)
    spectra = Spectra(_FREQUENCIES, inputs=dict(zip(symbols, spectrum.T, strict=True)))
    return RunResult(result.aircraft.name, "excite", (), flight=flight, spectra=spectra)


SECTIONS: tuple[Section[ExciteResult], ...] = (
    Section("opening", "", "manoeuvre_opening.html.j2", manoeuvre.opening),
    Section("manoeuvre", "The manoeuvre", "manoeuvre.html.j2", manoeuvre.context),
    Section("prediction", "What it would tell", "prediction.html.j2", prediction.context),
    Section("correlations", "What it would not tell apart", "correlations.html.j2", correlations.context),
    Section(
        "excitation", "The flight that it gives", "excitation.html.j2", lambda result: excitation.context(_run(result))
    ),
)
