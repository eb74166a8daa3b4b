"""Equation error in the frequency domain: the regression within a band of frequencies.

Klein & Morelli, "Aircraft System Identification" (2006), sec. 7.2; Morelli, "Real-Time Parameter Estimation in the
Frequency Domain", JGCD 23(5), 2000. Trim, slow drift, sensor noise and structural vibration lie outside the band; a
constant and a line are removed as well.

Least squares on the finite Fourier transforms F y, F X at chosen frequencies is Z' (y - X theta) = 0 with the
band-passed regressors Z = Re F^H F X. In this form the standard errors follow from the residuals' colour as in the time
domain, and do not depend on the spacing of the frequencies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.errors_in_variables import ErrorsInVariables, SensorNoise
from sysid_node.batch.regression.filtering import pieces
from sysid_node.batch.regression.linear_regression import Regression, regress
from sysid_node.batch.regression.measured_coefficients import (
    MeasuredCoefficients,
    ReadingSensitivity,
    measured_coefficients,
    sensitivity_to_readings,
)
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient, sensor_noises
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.settings import DEFAULT_FREQUENCIES, Frequencies
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

#: A signal that varies by no more than this share of its size counts as constant.
_ROUNDING = 1e-9

#: Number of signals removed from every flight within the band: a constant and a slow drift.
_NUISANCES = 2


def frequency_equation_error(
    aircraft: Aircraft, records: Sequence[FlightRecord], frequencies: Frequencies = DEFAULT_FREQUENCIES
) -> BatchFit:
    """The aircraft file's derivatives from all flights together, within a band of ``frequencies`` (Hz).

    Offsets (``Cm_0``), which no frequency shows, follow from the means. Raises InputError where signals are missing, or
    where the flights hold too few independent frequencies for the model.
    """
    flights = [measured_coefficients(aircraft, record) for record in records]
    sensors = [sensitivity_to_readings(aircraft, record) for record in records]
    regressions = {
        coefficient: _regression(coefficient, regressors, flights, sensors, frequencies)
        for coefficient, regressors in regressors_by_coefficient(aircraft, flights).items()
    }
    return combined_fit("frequency_equation_error", regressions, flights)


def regress_in_band(
    names: Sequence[str],
    times: Sequence[Array],
    ys: Sequence[Array],
    Xs: Sequence[Array],
    frequencies: Frequencies,
    noises: Sequence[Sequence[SensorNoise]] = (),
) -> Regression:
    """Least squares of ``ys`` (N,) on ``Xs`` (N, p) within the band; constants must not be among the regressors.

    ``times`` (N,) s; ``noises``: what is known of the sensors' noise, flight by flight. Raises InputError where the
    band is impossible or holds too few independent frequencies.
    """
    lines = _lines(frequencies, times)
    independent = 2.0 * (lines[-1] - lines[0]) * sum(float(t[-1] - t[0]) for t in times)
    freedom = independent - len(names) - _NUISANCES * len(times)
    if freedom < 1.0:
        raise InputError(
            f"{lines[0]:g} to {lines[-1]:g} Hz holds {independent:.0f} independent values in these flights, too few "
            f"for {len(names)} regressors ({', '.join(names)}); give a longer flight or a wider band"
        )
    # a constant and a line change no estimate, but they would leak into the residuals' spectrum
    detrended_ys, detrended_Xs = [_detrended(y) for y in ys], [_detrended(X) for X in Xs]
    instruments = [_band_passed(t, X, lines) for t, X in zip(times, detrended_Xs, strict=True)]
    sensor_errors = [
        ErrorsInVariables(Z, lines.size * float(np.median(np.diff(t))) ** 2, of_flight)
        for Z, t, of_flight in zip(instruments, times, noises, strict=bool(noises))
    ]
    regression = regress(names, detrended_ys, detrended_Xs, instruments, freedom, sensor_errors)
    values = np.array([estimate.value for estimate in regression.estimates.values()])
    return replace(regression, modelled=[X @ values for X in Xs])


def _lines(frequencies: Frequencies, times: Sequence[Array]) -> Array:
    """The frequencies (K,) Hz. Raises InputError where they are impossible or above half the sampling rate."""
    start, step, stop = frequencies
    rate = min(1.0 / float(np.median(np.diff(t))) for t in times)
    if not (0.0 < start < stop and step > 0.0):
        raise InputError(f"frequencies {start:g}:{step:g}:{stop:g}: expected 0 < start < stop and step > 0, in Hz")
    if stop >= 0.5 * rate:
        raise InputError(
            f"frequencies up to {stop:g} Hz: a flight sampled at {rate:g} Hz shows only up to {rate / 2:g} Hz"
        )
    return np.asarray(np.arange(start, stop + 0.5 * step, step))


def _band_passed(time: Array, X: Array, lines: Array) -> Array:
    """Z (N, p) = Re F^H F X, made orthogonal to a constant and a line; nothing is integrated over an interruption."""
    weight = np.concatenate([_trapezoidal(time[part]) for part in pieces(time)])
    fourier = np.exp(-2j * np.pi * np.outer(lines, time - time[0])) * weight
    drift = _drift(time.size)
    both = fourier.conj().T @ (fourier @ np.column_stack([X, drift]))
    passed, passed_drift = both.real[:, : X.shape[1]], both.real[:, X.shape[1] :]
    slopes = np.linalg.lstsq(drift.T @ passed_drift, drift.T @ passed, rcond=None)[0]
    return np.asarray(passed - passed_drift @ slopes)


def _trapezoidal(time: Array) -> Array:
    """Weights (N,) of the trapezoidal rule at the samples' own times, s."""
    if time.size < 2:
        return np.zeros(time.size)
    weight = np.gradient(time)
    weight[[0, -1]] *= 0.5
    return weight


def _drift(samples: int) -> Array:
    """A constant and a line (N, 2)."""
    return np.column_stack([np.ones(samples), np.linspace(-1.0, 1.0, samples)])


def _detrended(x: Array) -> Array:
    """``x`` (N, ...) without its constant and line; a rest of the size of rounding errors becomes zero."""
    drift = _drift(len(x))
    rest = x - drift @ np.linalg.lstsq(drift, x, rcond=None)[0]
    return np.where(np.ptp(rest, axis=0) > _ROUNDING * np.abs(x).max(axis=0), rest, 0.0)


def _regression(
    coefficient: str,
    regressors: Sequence[str],
    flights: Sequence[MeasuredCoefficients],
    sensors: Sequence[Mapping[str, tuple[Array, ReadingSensitivity]]],
    frequencies: Frequencies,
) -> Regression:
    """The regression of one coefficient: derivatives within the band, then the offset, where the model has one."""
    varying = [name for name in regressors if name != "0"]
    times, ys = [flight.time for flight in flights], [flight.coefficients[coefficient] for flight in flights]
    Xs = [regressor_matrix(flight, varying) for flight in flights]
    noises = [sensor_noises(t, s, coefficient, varying, frequencies[2]) for t, s in zip(times, sensors, strict=True)]
    in_band = regress_in_band([f"{coefficient}_{name}" for name in varying], times, ys, Xs, frequencies, noises)
    rest = [y - modelled for y, modelled in zip(ys, in_band.modelled, strict=True)]
    offset = regress([f"{coefficient}_0"], rest, [np.ones((r.size, 1)) for r in rest])
    modelled = [m + o for m, o in zip(in_band.modelled, offset.modelled, strict=True)]
    if "0" not in regressors:
        return replace(in_band, modelled=modelled, noise=offset.noise)
    return _with_offset(regressors, in_band, offset, np.concatenate(Xs).mean(axis=0), modelled)


def _with_offset(
    regressors: Sequence[str], in_band: Regression, offset: Regression, means: Array, modelled: list[Array]
) -> Regression:
    """Derivatives and offset in the model's order; ``means`` (p,) are the regressors'.

    The offset's variance includes that of the derivatives.
    """
    count = len(in_band.estimates)
    covariance = np.zeros((count + 1, count + 1))
    covariance[:count, :count] = in_band.covariance
    covariance[count, :count] = covariance[:count, count] = -means @ in_band.covariance
    covariance[count, count] = offset.covariance[0, 0] + means @ in_band.covariance @ means
    estimates = dict(in_band.estimates)
    ((name, alone),) = offset.estimates.items()
    error = float(np.sqrt(covariance[count, count]))
    half = error * ((alone.upper - alone.value) / alone.standard_error if alone.standard_error > 0.0 else 1.96)
    estimates[name] = replace(alone, standard_error=error, lower=alone.value - half, upper=alone.value + half)
    # a regressor that is constant, but not zero, has the same effect as the offset
    unidentifiable = {n for group in in_band.unidentifiable for n in group}
    shared = [n for n, mean in zip(in_band.estimates, means, strict=True) if mean and n in unidentifiable]
    if shared:
        estimates[name] = estimates[name].invalid(f"collinear with {', '.join(shared)}")
    coefficient = name.partition("_")[0]
    order = [f"{coefficient}_{regressor}" for regressor in regressors]
    index = [list(estimates).index(n) for n in order]
    return Regression(
        {n: estimates[n] for n in order},
        covariance[np.ix_(index, index)],
        modelled,
        offset.noise,
        in_band.unidentifiable,
    )
