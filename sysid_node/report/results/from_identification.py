"""From flights identified by a batch method to a RunResult."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.identify import Identification
from sysid_node.batch.models.rigid_body import OUTPUTS
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.results.response import ModelResponse, goodness_of_fit
from sysid_node.batch.settings import BatchSettings
from sysid_node.faults.recorded_rate_limits import rate_limits_of
from sysid_node.flight.commanded import carried_in_words
from sysid_node.flight.record import FlightRecord
from sysid_node.online.estimates.servo_gap import surely_late
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.report.drawing.spectrum import amplitude_spectrum
from sysid_node.report.results.run_result import References, RunData, RunResult, prior_of
from sysid_node.report.results.servo_remarks import servo_remarks
from sysid_node.report.results.signals import Response, RunSignals, Spectra

#: Frequencies of the drawn spectra, Hz.
_SPECTRUM = np.arange(0.1, 5.01, 0.1)


def identification_result(
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    found: Identification,
    settings: BatchSettings,
    truth: Mapping[str, float] | None = None,
) -> RunResult:
    """The result of a batch method as the reports take it. ``records`` are the flights that were fitted."""
    fit, first = found.fit, records[0]
    commanded = any(record.commanded for record in records)
    trusted = "ok" if fit.search.converged else "not converged"
    derivatives = {
        name: _derivative(name, fit.estimates.get(name), trusted, fit.remarks) for name in aircraft.derivatives
    }
    servos = {name: _derivative(name, estimate, "ok", ()) for name, estimate in fit.systematic.servos.items()}
    carried = carried_in_words(aircraft, settings.actuators, commanded, surely_late(servos))
    estimates = Estimates(
        sum(record.duration for record in records), derivatives, _fits(found), servos, fit.systematic.budget
    )
    return RunResult(
        aircraft=aircraft.name,
        method=fit.method,
        history=[*_history(fit), estimates],
        data=RunData(
            sum(record.duration for record in records), sum(len(record) for record in records), _rejected(records)
        ),
        settings={**settings.as_dict(fit.method), "actuators_carry": "commands" if commanded else "positions"},
        references=References(prior_of(aircraft), truth or {}),
        signals=RunSignals(
            first, _spectra(aircraft, first, found.coefficients), _responses(found), _note(records, settings)
        ),
        holdout=found.holdout,
        remarks=[
            *(_sentence(remark) for remark in (fit.search.message, *fit.remarks, carried) if remark),
            *servo_remarks(aircraft, estimates),
            *(_limited(record, fault.text) for record in records for fault in rate_limits_of(aircraft, record)),
        ],
    )


def _limited(record: FlightRecord, fault: str) -> str:
    return f"Something seems to have failed in {record.name}: {fault}; its deflections are not what was recorded."


def _derivative(
    name: str, estimate: ParameterEstimate | None, trusted: str, remarks: Sequence[str]
) -> DerivativeEstimate:
    """The final estimate of a derivative; one that was not estimated has the reason as its status."""
    if estimate is None:
        coefficient = name.partition("_")[0]
        reasons = [remark for remark in remarks if name in remark or coefficient in remark]
        status = reasons[0] if reasons else "not part of the model that these flights allow"
        return DerivativeEstimate(name, np.nan, np.nan, np.nan, np.nan, False, status)
    status = estimate.status if not estimate.valid or trusted == "ok" else trusted
    valid = estimate.valid and trusted == "ok"
    return DerivativeEstimate(
        name,
        estimate.value,
        estimate.standard_error,
        estimate.lower,
        estimate.upper,
        valid,
        status,
        estimate.statistical_error,
        estimate.systematic_error,
    )


def _history(fit: BatchFit) -> list[Estimates]:
    """The estimates at the end of each second, where the method passes along the flights once; else nothing."""
    track = fit.track
    if track is None:
        return []
    ends_of_seconds = np.flatnonzero(np.diff(np.floor(track.time)) > 0.0)
    return [
        Estimates(
            float(track.time[k]),
            {
                name: _derivative(name, e.with_systematic(fit.estimates[name].systematic_error), "ok", ())
                for name, e in track.at(int(k)).items()
            },
            {},
        )
        for k in ends_of_seconds
    ]


def _fits(found: Identification) -> dict[str, FitQuality]:
    """The quality of fit of each coefficient, and of each output of a method that integrates."""
    names = list(found.fit.estimates)
    table = {}
    for name, q in (goodness_of_fit(found.fit.responses) | goodness_of_fit(found.coefficients)).items():
        parameters = sum(key.startswith(f"{name}_") for key in names)
        freedom = float(q.samples - (parameters or len(names)))
        table[name] = FitQuality(name, q.r_squared, q.residual_std, freedom, q.samples)
    return table


def _responses(found: Identification) -> dict[str, Response]:
    """Outputs and coefficients of the first flight."""
    table = {}
    for response in (*found.fit.responses[:1], *found.coefficients[:1]):
        for name in response.names:
            table[name] = Response(OUTPUTS.get(name, ""), response.time, *response.column(name))
    return table


def _note(records: Sequence[FlightRecord], settings: BatchSettings) -> str:
    which = f"The first of {len(records)} flights. " if len(records) > 1 else ""
    return f"{which}Coefficients are shown below {settings.low_pass:g} Hz." if settings.low_pass else which


def _spectra(aircraft: Aircraft, record: FlightRecord, coefficients: Sequence[ModelResponse]) -> Spectra | None:
    """Spectra of the first flight: controls, coefficients and residuals."""
    if not coefficients:
        return None
    response = coefficients[0]
    frequency = _SPECTRUM[0.4 / float(np.median(np.diff(response.time))) > _SPECTRUM]
    complete = [symbol for symbol in aircraft.control_symbols if np.isfinite(record[symbol]).all()]
    deflections = np.array([record[symbol] for symbol in complete]).reshape(len(complete), len(record)).T
    inputs = amplitude_spectrum(record.time, deflections, frequency)
    measured = amplitude_spectrum(response.time, response.measured, frequency)
    residuals = amplitude_spectrum(response.time, response.residuals, frequency)
    return Spectra(
        frequency,
        dict(zip(complete, inputs.T, strict=True)),
        dict(zip(response.names, measured.T, strict=True)),
        dict(zip(response.names, residuals.T, strict=True)),
    )


def _rejected(records: Sequence[FlightRecord]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for record in records:
        total.update(record.rejected)
    return dict(total)


def _sentence(text: str) -> str:
    named = text.split(maxsplit=1)[0].endswith(":")  # a flight's name, which is left as it is
    return f"{text[0] if named else text[0].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"
