"""From a replayed or live record to a RunResult.

The measured coefficients drawn here differentiate the rates numerically, which the estimator itself does not do; they
serve the eye. The estimates do not depend on anything in this file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.recorded_flight import FaultVerdict
from sysid_node.flight.record import Array
from sysid_node.online.frequency.regression_signals import OFFSET, array_signals, layout, momentum_matrix
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates
from sysid_node.report.drawing.spectrum import amplitude_spectrum
from sysid_node.report.results.comparison import changes
from sysid_node.report.results.late_controls import late_controls
from sysid_node.report.results.recorded_samples import RecordedSamples
from sysid_node.report.results.run_result import References, RunData, RunResult, prior_of
from sysid_node.report.results.servo_remarks import servo_remarks
from sysid_node.report.results.signals import Response, RunSignals, Spectra

THRUST = SAMPLE_COLUMNS.index("thrust")
FEWEST = 10  # samples below which nothing is drawn
POINTS_A_PERIOD = 8  # drawn points of a response in a period of the highest frequency in use
RESPONSE_NOTE = "Both are averaged over half the shortest period in use; measured moments hold differentiated rates."


@dataclass(frozen=True)
class CoefficientHistories:
    """Complete samples with their coefficients, name -> (N,), as measured and from the final estimates."""

    time: Array  # (N,) s
    controls: Mapping[str, Array]  # symbol -> (N,) rad
    measured: Mapping[str, Array]
    modelled: Mapping[str, Array]  # where all derivatives of the coefficient are known

    def since(self, start: float) -> CoefficientHistories | None:
        """The part from ``start`` (s) on; None for fewer than ten samples."""
        first = int(np.searchsorted(self.time, start))
        groups = (self.controls, self.measured, self.modelled)
        later = ({name: values[first:] for name, values in group.items()} for group in groups)
        return CoefficientHistories(self.time[first:], *later) if self.time.size - first >= FEWEST else None


def replay_result(
    aircraft: Aircraft,
    settings: OnlineSettings,
    *,
    recorded: RecordedSamples,
    history: Sequence[Estimates],
    rejected: Mapping[str, int],
    truth: Mapping[str, float] | None = None,
    truth_since: Mapping[str, float] | None = None,
    title: str = "",
    faults: FaultVerdict | None = None,
    remarks: Sequence[str] = (),
    commanded: bool = False,
) -> RunResult:
    """All that a report needs, from the aligned samples and the estimates over time.

    ``commanded``: whether the samples' deflections follow from commands by the aircraft file's servos.
    """
    noticed = sorted({at for e in history[-1:] for name in e.derivatives for at in changes(history, name)})
    motion = _motion(aircraft, *recorded.last, history, commanded=commanded)
    counted = motion and motion.since(max(noticed, default=0.0))
    return RunResult(
        aircraft=aircraft.name,
        method=settings.method,
        history=history,
        title=title,
        data=RunData(recorded.seconds, recorded.count, rejected),
        settings=settings.as_dict(),
        references=References(prior_of(aircraft), truth or {}, truth_since or {}),
        signals=RunSignals(
            recorded.flight,
            _spectra(settings, counted) if counted else None,
            _responses(settings, motion) if motion else {},
            RESPONSE_NOTE,
        ),
        faults=faults,
        remarks=[
            *remarks,
            *recorded.remarks,
            *(servo_remarks(aircraft, history[-1]) if history else []),
            *_change_remark(noticed),
            *_fault_remarks(faults),
        ],
    )


def _change_remark(noticed: Sequence[float]) -> list[str]:
    if not noticed:
        return []
    when = " and ".join(f"{at:.1f} s" for at in noticed)
    return [f"An abrupt change was noticed at {when}: estimates and spectra rest on what was flown since."]


def _fault_remarks(faults: FaultVerdict | None) -> list[str]:
    """One remark for each fault."""
    return [f"Something seems to have failed: {one.text}." for one in faults.episodes] if faults else []


def _motion(
    aircraft: Aircraft, time: Array, samples: Array, history: Sequence[Estimates], *, commanded: bool
) -> CoefficientHistories | None:
    """The complete samples, an unknown thrust taken as zero, as in the estimator; None for fewer than ten.

    The model has the deflections behind servos with the estimated times, as the estimator has them.
    """
    filled = samples.copy()
    filled[np.isnan(filled[:, THRUST]), THRUST] = 0.0
    complete = np.isfinite(filled).all(axis=1)
    if complete.sum() < FEWEST:
        return None
    time, filled = time[complete], filled[complete]
    recorded = filled[:, len(SAMPLE_COLUMNS) :].copy()
    if history:
        servos = history[-1].servos
        filled[:, len(SAMPLE_COLUMNS) :] = late_controls(aircraft, time, recorded, servos, commanded=commanded)
    row, (ca, sa) = array_signals(aircraft)(list(filled.T))
    acceleration = np.gradient(filled[:, 3:6], time, axis=0)
    X, Y, Z, L, M, N = (acceleration @ momentum_matrix(aircraft)).T
    inertial = (X * sa - Z * ca, -X * ca - Z * sa, Y, L, M, N)  # of rates and of the IMU's lever arm
    k = row[OFFSET]
    measured = {c: (row[i] + inertial[i]) / k for i, c in enumerate(COEFFICIENTS)}
    columns = layout(aircraft)
    # the row lacks the drift, which stands before the regressors
    regressors = {name: row[columns.column(name) - 1] / k for name in columns.regressors}
    modelled = _modelled(aircraft, {"0": np.ones(time.size), **regressors}, history[-1]) if history else {}
    controls = dict(zip(aircraft.control_symbols, recorded.T, strict=True))
    return CoefficientHistories(time, controls, measured, modelled)


def _modelled(aircraft: Aircraft, regressors: Mapping[str, Array], final: Estimates) -> dict[str, Array]:
    """Each coefficient (N,) from the final estimates; left out where one of its derivatives is unknown."""
    modelled = {}
    for coefficient, names in aircraft.model_structure.items():
        values = [final.derivatives[f"{coefficient}_{r}"].value for r in names]
        if np.isfinite(values).all():
            pairs = zip(values, names, strict=True)
            modelled[coefficient] = np.sum([value * regressors[r] for value, r in pairs], axis=0)
    return modelled


def _spectra(settings: OnlineSettings, motion: CoefficientHistories) -> Spectra:
    """Inputs, coefficients and residuals at the frequencies in use."""
    start, step, stop = settings.frequencies
    frequency = np.arange(start, stop + 0.5 * step, step)
    measured = {c: motion.measured[c] for c in motion.modelled}
    residuals = {c: motion.measured[c] - values for c, values in motion.modelled.items()}
    groups = (motion.controls, measured, residuals)
    columns = np.stack([values for group in groups for values in group.values()], axis=1)
    every = max(int(1.0 / (POINTS_A_PERIOD * 2 * stop * np.median(np.diff(motion.time)))), 1)
    amplitudes = iter(amplitude_spectrum(_averaged(motion.time, every), _averaged(columns, every), frequency).T)
    return Spectra(frequency, *({name: next(amplitudes) for name in group} for group in groups))


def _averaged(values: Array, every: int) -> Array:
    """Means over ``every`` samples (N, ...). With sixteen means in a period they reduce an amplitude by 0.6 %."""
    whole = values[: values.shape[0] // every * every]
    return np.asarray(whole.reshape(-1, every, *values.shape[1:]).mean(axis=1))


def _responses(settings: OnlineSettings, motion: CoefficientHistories) -> dict[str, Response]:
    """Measured and modelled coefficients, averaged over half the shortest period in use to remove noise above it."""
    step = float(np.median(np.diff(motion.time)))
    width = max(round(0.5 / (settings.frequencies[2] * step)), 1)
    every = max(2 * width // POINTS_A_PERIOD, 1)

    def smooth(values: Array) -> Array:
        return np.convolve(values, np.full(width, 1.0 / width), mode="valid")[::every]

    if motion.time.size < width:
        return {}
    time = smooth(motion.time)
    return {c: Response("", time, smooth(motion.measured[c]), smooth(values)) for c, values in motion.modelled.items()}
