"""Equation error in the frequency domain: the same regression within a band, where the aircraft moves and little else.

Klein & Morelli (2006), sec. 7.2; Morelli, "Real-Time Parameter Estimation in the Frequency Domain", JGCD 23(5), 2000.
Trim, slow drift (a constant and a line are taken out with it), sensor noise and structural vibration stay outside.

Least squares on the finite Fourier transforms F y, F X at chosen frequencies is Z' (y - X theta) = 0 with the
band-passed regressors Z = Re F^H F X. Seen so, its standard errors follow from the residuals' colour as in the time
domain, and do not depend on how densely the frequencies lie.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.errors_in_variables import ErrorsInVariables, SensorNoise
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

#: A signal that moves by no more of its size than this does not move.
_ROUNDING = 1e-9

#: What is taken out of every flight within the band: a constant and a slow drift.
_NUISANCES = 2


def frequency_equation_error(
    aircraft: Aircraft, records: Sequence[FlightRecord], frequencies: Frequencies = DEFAULT_FREQUENCIES
) -> BatchFit:
    """The aircraft file's derivatives from all flights together, within a band of frequencies.

    Offsets (``Cm_0``), which no frequency shows, follow from the means. Raises InputError where signals are missing, or
    the flights hold too few independent frequencies for the model.
    """
    flights = [measured_coefficients(aircraft, record) for record in records]
    sensors = [sensitivity_to_readings(aircraft, record) for record in records]
    fits = {
        coefficient: _fit(coefficient, regressors, flights, sensors, frequencies)
        for coefficient, regressors in regressors_by_coefficient(aircraft, flights).items()
    }
    return combined_fit("frequency_equation_error", fits, flights)


def regress_in_band(
    names: Sequence[str],
    times: Sequence[Array],
    ys: Sequence[Array],
    Xs: Sequence[Array],
    frequencies: Frequencies,
    noises: Sequence[Sequence[SensorNoise]] = (),
) -> Regression:
    """Least squares of ``ys`` (N,) on ``Xs`` (N, p) within the band; constants must not be among the regressors.

    ``noises``: what is known of the sensors' noise, flight by flight.
    Raises InputError where the band is impossible or holds too few independent lines.
    """
    lines = _lines(frequencies, times)
    independent = 2.0 * (lines[-1] - lines[0]) * sum(float(t[-1] - t[0]) for t in times)
    freedom = independent - len(names) - _NUISANCES * len(times)
    if freedom < 1.0:
        raise InputError(
            f"{lines[0]:g} to {lines[-1]:g} Hz holds {independent:.0f} independent values in these flights, too few "
            f"for {len(names)} regressors ({', '.join(names)}); give a longer flight or a wider band"
        )
    # neither constant nor line changes the estimates, but they would leak into the residuals' spectrum
    sides = [_detrended(y) for y in ys], [_detrended(X) for X in Xs]
    instruments = [_band_passed(t, X, lines) for t, X in zip(times, sides[1], strict=True)]
    noisy = [
        ErrorsInVariables(Z, lines.size * float(np.median(np.diff(t))) ** 2, several)
        for Z, t, several in zip(instruments, times, noises, strict=bool(noises))
    ]
    fit = regress(names, *sides, instruments, freedom, noisy)
    values = np.array([estimate.value for estimate in fit.estimates.values()])
    return replace(fit, modelled=[X @ values for X in Xs])


def _lines(frequencies: Frequencies, times: Sequence[Array]) -> Array:
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
    """Z (N, p) = Re F^H F X, made blind to a constant and a line."""
    weight = np.gradient(time)
    weight[[0, -1]] *= 0.5  # trapezoidal rule at the samples' own times
    fourier = np.exp(-2j * np.pi * np.outer(lines, time - time[0])) * weight
    drift = _drift(time.size)
    both = fourier.conj().T @ (fourier @ np.column_stack([X, drift]))
    passed, passed_drift = both.real[:, : X.shape[1]], both.real[:, X.shape[1] :]
    slopes = np.linalg.lstsq(drift.T @ passed_drift, drift.T @ passed, rcond=None)[0]
    return np.asarray(passed - passed_drift @ slopes)


def _drift(samples: int) -> Array:
    """A constant and a line (N, 2)."""
    return np.column_stack([np.ones(samples), np.linspace(-1.0, 1.0, samples)])


def _detrended(x: Array) -> Array:
    """``x`` (N, ...) less its constant and line; what is then rounding error is zero."""
    drift = _drift(len(x))
    rest = x - drift @ np.linalg.lstsq(drift, x, rcond=None)[0]
    return np.where(np.ptp(rest, axis=0) > _ROUNDING * np.abs(x).max(axis=0), rest, 0.0)


def _fit(
    coefficient: str,
    regressors: Sequence[str],
    flights: Sequence[MeasuredCoefficients],
    sensors: Sequence[Mapping[str, tuple[Array, ReadingSensitivity]]],
    frequencies: Frequencies,
) -> Regression:
    """One coefficient: the derivatives within the band, then the offset, where the model has one."""
    varying = [name for name in regressors if name != "0"]
    times, ys = [flight.time for flight in flights], [flight.coefficients[coefficient] for flight in flights]
    Xs = [regressor_matrix(flight, varying) for flight in flights]
    noise_of = [sensor_noises(t, s, coefficient, varying, frequencies[2]) for t, s in zip(times, sensors, strict=True)]
    fit = regress_in_band([f"{coefficient}_{name}" for name in varying], times, ys, Xs, frequencies, noise_of)
    rest = [y - modelled for y, modelled in zip(ys, fit.modelled, strict=True)]
    offset = regress([f"{coefficient}_0"], rest, [np.ones((r.size, 1)) for r in rest])
    modelled = [m + o for m, o in zip(fit.modelled, offset.modelled, strict=True)]
    if "0" not in regressors:
        return Regression(fit.estimates, fit.covariance, modelled, offset.noise, fit.lost)
    return _joined(regressors, fit, offset, np.concatenate(Xs).mean(axis=0), modelled)


def _joined(
    regressors: Sequence[str], fit: Regression, offset: Regression, means: Array, modelled: list[Array]
) -> Regression:
    """Derivatives and offset in the model's order; the offset's error includes that of the derivatives."""
    count = len(fit.estimates)
    covariance = np.zeros((count + 1, count + 1))
    covariance[:count, :count] = fit.covariance
    covariance[count, :count] = covariance[:count, count] = -means @ fit.covariance
    covariance[count, count] = offset.covariance[0, 0] + means @ fit.covariance @ means
    found = dict(fit.estimates)
    ((name, alone),) = offset.estimates.items()
    error = float(np.sqrt(covariance[count, count]))
    half = error * ((alone.upper - alone.value) / alone.standard_error if alone.standard_error > 0.0 else 1.96)
    offset_estimate = replace(alone, standard_error=error, lower=alone.value - half, upper=alone.value + half)
    # what the flight shows no derivative of, but was not zero, may as well be the offset
    shared = [n for n, mean in zip(fit.estimates, means, strict=True) if mean and any(n in group for group in fit.lost)]
    if shared:
        offset_estimate = replace(offset_estimate, valid=False, status=f"collinear with {', '.join(shared)}")
    found[name] = offset_estimate
    coefficient = name.partition("_")[0]
    order = [f"{coefficient}_{regressor}" for regressor in regressors]
    index = [list(found).index(n) for n in order]
    return Regression({n: found[n] for n in order}, covariance[np.ix_(index, index)], modelled, offset.noise, fit.lost)
