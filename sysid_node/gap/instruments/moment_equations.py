"""Moment equations: the part of a residual that is correlated with instruments, as equations for all unknowns.

A residual is projected on the directions that the instruments span, channel by channel. The sum of squares of this
projection is quadratic in a step of the unknowns; with the priors and with the means of the flights it forms the normal
equations of two-stage least squares (the generalised method of moments: Hansen (1982), Econometrica 50(4)).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.bounded_least_squares import bounded_least_squares
from sysid_node.gap.estimation.candidate_fit import CandidateFit, FlightFit, step_limits
from sysid_node.gap.estimation.spectral_weights import real_rows, weights
from sysid_node.gap.instruments.gust_free_signals import Instruments, gust_free_instruments
from sysid_node.gap.residuals.parameter_priors import prior
from sysid_node.gap.residuals.prediction_cache import cache_of
from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import Complex

#: Singular value of the instruments, as a share of the largest, below which a direction counts as noise.
_LEAST_SINGULAR_VALUE = 1e-3


@dataclass(frozen=True)
class FlightMoments:
    """What the instruments see of one flight, the means left out."""

    basis: dict[int, Array]  # by channel: orthonormal directions (W 2 L, m) that the instruments span
    rows: Array  # (W, 2 L, 12) weighted residual
    slopes: Array  # (W, 2 L, 12, unknowns) weighted slopes


@dataclass(frozen=True)
class MomentEquations:
    """The sum of squares that the instruments see of a fit, quadratic in the step of all unknowns, priors included.

    It is ``constant - 2 right . step + step . information step``.
    """

    flights: list[FlightMoments]
    information: Array  # (unknowns, unknowns)
    right: Array  # (unknowns,)
    constant: float


def moment_equations(
    fit: CandidateFit, powers: Sequence[Array], by: Instruments = gust_free_instruments, *, whole: bool = False
) -> MomentEquations:
    """The moment equations of a linearised fit about where it stands, in noise of these powers (L, 12) by flight.

    ``whole``: with all of air data and attitude, whatever the instruments see of them.
    """
    flights = [_flight_moments(f, power, by) for f, power in zip(fit.flights, powers, strict=True)]
    precision, offset = prior_terms(fit)
    information, right = np.diag(precision), -precision * offset
    constant = float(precision @ offset**2)
    parts = [
        (directions.T @ f.rows[:, :, axis].ravel(), directions.T @ f.slopes[:, :, axis].reshape(-1, f.slopes.shape[3]))
        for f in flights
        for axis, directions in f.basis.items()
        if axis < len(COEFFICIENTS) or not whole
    ]
    if whole:
        kept = [(f.rows[:, :, len(COEFFICIENTS) :], f.slopes[:, :, len(COEFFICIENTS) :]) for f in flights]
        parts += [(r.ravel(), J.reshape(-1, J.shape[3])) for r, J in kept]
    for series, slopes in [*parts, *_means(fit, powers)]:
        information += slopes.T @ slopes
        right += slopes.T @ series
        constant += float(series @ series)
    return MomentEquations(flights, information, right, constant)


def limited_step(equations: MomentEquations, fit: CandidateFit) -> Array:
    """The step (unknowns,) that solves moment equations with every unknown within its limits."""
    return bounded_least_squares(equations.information, equations.right, *step_limits(fit))


def prior_terms(fit: CandidateFit) -> tuple[Array, Array]:
    """Precision (unknowns,) of each unknown's prior, and how far (unknowns,) the fit is from the prior's centre."""
    now, spread, _ = fit.stacked
    centre, sigma = prior(fit.simulator, fit.indices)
    return np.concatenate([sigma, spread]) ** -2.0, np.concatenate([fit.values - centre, now])


def weights_without_mean(model: ResidualModel, power: Array) -> Array:
    """Weights (2 L, 12) of the residual's real and imaginary parts; zero at zero frequency."""
    weight = weights(power)
    weight[[0, model.windows.frequencies.size]] = 0.0
    return weight


def _means(fit: CandidateFit, powers: Sequence[Array]) -> Iterator[tuple[Array, Array]]:
    """Means by flight, in which gusts average out: residuals (W 12,) and slopes (W 12, unknowns)."""
    for flight, power in zip(fit.flights, powers, strict=True):
        r, J, ratio = flight.rows, flight.slopes, np.sqrt(flight.power[0] / power[0])
        mean = r.reshape(r.shape[0], -1, len(CHANNELS))[:, 0] * ratio
        slope = J.reshape(J.shape[0], -1, len(CHANNELS), J.shape[2])[:, 0] * ratio[:, None]
        yield mean.ravel(), slope.reshape(-1, J.shape[2])


def _flight_moments(flight: FlightFit, power: Array, by: Instruments) -> FlightMoments:
    """What the instruments see of a flight in noise of a power (L, 12)."""
    model, r, J = flight.model, flight.rows, flight.slopes
    weight, fitted = weights_without_mean(model, power), flight.weights
    ratio = np.where(fitted > 0, weight / np.where(fitted > 0, fitted, 1.0), 0.0).ravel()
    rows = (r * ratio).reshape(r.shape[0], -1, len(CHANNELS))
    slopes = (J * ratio[:, None]).reshape(r.shape[0], -1, len(CHANNELS), J.shape[2])
    key = by.__name__.encode() + weight.tobytes()
    return FlightMoments(cache_of(model).result(key, partial(_basis, model, weight, by)), rows, slopes)


def _basis(model: ResidualModel, weight: Array, by: Instruments) -> dict[int, Array]:
    """Orthonormal directions (rows, m) that the instruments span, by channel that was measured."""
    tables = cache_of(model).constant(f"spectra by {by.__name__}", lambda: _spectra(model, by))
    found = {}
    for axis in np.flatnonzero(model.axes):
        spectra = tables[0 if axis < len(COEFFICIENTS) else 1]
        if not spectra.size:
            continue
        column = weight[:, axis : axis + 1]
        rows = real_rows(spectra, np.repeat(column, spectra.shape[2], axis=1))
        matrix = rows.reshape(rows.shape[0] * column.shape[0], -1)
        left, sizes, _ = np.linalg.svd(matrix, full_matrices=False)
        found[int(axis)] = np.asarray(left[:, sizes > _LEAST_SINGULAR_VALUE * sizes[0]])
    return found


def _spectra(model: ResidualModel, by: Instruments) -> list[Complex]:
    """Instruments by window and line, each (W, L, M); empty where there are none."""
    return [model.windows.transform(t) if t.size else np.empty((0, 0, 0), complex) for t in by(model)]
