"""Candidates fitted to flights: what the fit of a flight consists of, and the fit of several flights together.

The unknowns are ordered: the candidates' parameters, then the nuisance parameters that all flights share, then each
flight's own. Slopes, information and steps of all flights follow this order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.nuisances import DERIVATIVE_ERROR, Nuisances
from sysid_node.gap.estimation.spectral_weights import (
    noise_gradient,
    real_rows,
    residual_power,
    spectral_deviance,
    weights,
)
from sysid_node.gap.residuals.parameter_priors import bounds, prior
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.residuals.windowed_spectra import Complex
from sysid_node.sim import Simulator

#: Share of its limit from which on a nuisance parameter counts as standing at it.
_AT_LIMIT = 1.0 - 1e-9


@dataclass(frozen=True)
class FlightFit:
    """One flight of a fit: its residual model, its nuisance parameters, and where the parameters stand."""

    model: ResidualModel
    nuisances: Nuisances
    point: Array  # (P,) all parameters of the simulator, nuisances included
    power: Array  # (L, 12) of the residual, from which its weights follow
    rows: Array = field(default_factory=lambda: np.empty((0, 0)))  # (W, R) weighted residual, once linearised
    slopes: Array = field(default_factory=lambda: np.empty((0, 0, 0)))  # (W, R, unknowns) weighted, once linearised

    @property
    def weights(self) -> Array:
        """Weights (2 L, 12) of the residual's real and imaginary parts."""
        return weights(self.power)

    @property
    def residual(self) -> Complex:
        """Measured minus predicted (W, L, 12)."""
        return self.model.residual(self.point)

    def at(self, point: Array) -> FlightFit:
        """The same flight at other parameters (P,), not linearised anew."""
        return replace(self, point=point)


@dataclass(frozen=True)
class CandidateFit:
    """A set of candidates fitted to one or more flights of one simulator."""

    flights: tuple[FlightFit, ...]
    candidates: tuple[Candidate, ...]
    information: Array | None = None  # (unknowns, unknowns), once linearised
    cost: float = np.inf  # weighted sum of squares, priors included, once linearised

    @property
    def simulator(self) -> Simulator:
        """The simulator whose parameters are fitted."""
        return self.flights[0].model.simulator

    @property
    def models(self) -> tuple[ResidualModel, ...]:
        """Residual models by flight."""
        return tuple(flight.model for flight in self.flights)

    @property
    def powers(self) -> tuple[Array, ...]:
        """Power (L, 12) of the residual by flight."""
        return tuple(flight.power for flight in self.flights)

    @property
    def nuisances(self) -> Nuisances:
        """Nuisance parameters: the same ones in every flight."""
        return self.flights[0].nuisances

    @property
    def indices(self) -> tuple[int, ...]:
        """Entries of the parameter vector that the candidates fit."""
        return tuple(dict.fromkeys(i for c in self.candidates for i in c.indices))

    @property
    def widened(self) -> tuple[int, ...]:
        """Entries of nuisance parameters whose priors the candidates widen."""
        return tuple(i for c in self.candidates for i in c.widened)

    @property
    def log_widening(self) -> float:
        """Nats by which the prior is less dense at its maximum: widened priors, and which of several are widened."""
        return self.nuisances.widened + sum(c.log_choices for c in self.candidates)

    @property
    def uncertain(self) -> NDArray[np.bool_]:
        """Which of all unknowns (unknowns,) count as uncertain when flights are predicted.

        Parameters that only shape an effect do not, nor do nuisance parameters that stand at their limits.
        """
        assert self.information is not None
        uncertain = np.ones(self.information.shape[0], bool)
        uncertain[: len(self.indices)] = self.sizing
        now, _, limit = self.stacked
        uncertain[len(self.indices) :] = np.abs(now) < limit * _AT_LIMIT
        return uncertain

    @property
    def sizing(self) -> NDArray[np.bool_]:
        """Which of the candidates' parameters are sizes; the others (an onset, an angle) only shape an effect."""
        return np.array([self.simulator.parameters[i][1].switch for i in self.indices], bool)

    @property
    def effects(self) -> frozenset[str]:
        """Names of the candidates' effects."""
        return frozenset(c.effect for c in self.candidates)

    @property
    def values(self) -> Array:
        """The candidates' parameters (K,)."""
        return np.asarray(self.flights[0].point[list(self.indices)])

    @property
    def covariance(self) -> Array:
        """Covariance (unknowns, unknowns): the inverse of the information."""
        assert self.information is not None
        return np.asarray(np.linalg.inv(self.information))

    @property
    def stacked(self) -> tuple[Array, Array, Array]:
        """Deviations from the file, prior standard deviations and limits of all flights' nuisance parameters."""
        _, shared, separate = self.sizes
        now, sigma, limit = (np.ones(shared + len(self.flights) * separate) for _ in range(3))
        for number, flight in enumerate(self.flights):
            places = flight.nuisances.places(number)
            indices = list(flight.nuisances.indices)
            now[places] = flight.point[indices] - self.simulator.neutral()[indices]
            sigma[places], limit[places] = flight.nuisances.sigma, flight.nuisances.limit
        return now, sigma, limit

    @property
    def prior_information(self) -> Array:
        """Information (unknowns, unknowns) of the priors alone."""
        _, spread, _ = self.stacked
        _, sigma = prior(self.simulator, self.indices)
        return np.diag(np.concatenate([sigma, spread]) ** -2.0)

    @property
    def prior_score(self) -> float:
        """Log prior density of where all unknowns stand, in nats, zero at its maximum.

        Wider priors lower it by the logarithm of how much wider they are (``log_widening``).
        """
        now, spread, _ = self.stacked
        centre, sigma = prior(self.simulator, self.indices)
        squares = float(np.sum((now / spread) ** 2) + np.sum(((self.values - centre) / sigma) ** 2))
        return -0.5 * squares - self.log_widening

    @property
    def spectral_deviance(self) -> float:
        """Minus twice the log likelihood where all unknowns stand, up to a constant, the spectra profiled out."""
        powers = ((np.abs(flight.residual) ** 2).mean(axis=0) for flight in self.flights)
        pairs = zip(self.flights, powers, strict=True)
        return sum(spectral_deviance(flight.model, power, flight.point) for flight, power in pairs)

    @property
    def deviance(self) -> float:
        """Minus twice the log posterior density where all unknowns stand, up to the same constant."""
        return self.spectral_deviance - 2.0 * self.prior_score

    @property
    def derivative_places(self) -> list[int]:
        """Places of the derivatives among the nuisance parameters that all flights share, which come first."""
        shared = (i for i, s in zip(self.nuisances.indices, self.nuisances.shared, strict=True) if s)
        return [k for k, i in enumerate(shared) if self.simulator.names[i].startswith(DERIVATIVE_ERROR)]

    @property
    def derivative_score(self) -> float:
        """The derivatives' part of ``prior_score``, nats."""
        now, spread, _ = self.stacked
        places = self.derivative_places
        return -0.5 * float(np.sum((now[places] / spread[places]) ** 2)) - self.log_widening

    @property
    def uncertain_log_widening(self) -> float:
        """The part of ``log_widening`` by the priors of unknowns that count as uncertain, nats."""
        if not self.widened:
            return 0.0
        nuisances, first = self.nuisances, len(self.indices)
        chosen = np.isin(nuisances.indices, self.widened) & self.uncertain[first + nuisances.places(0)]
        return float(np.log(nuisances.factors[chosen]).sum())

    def noise_gradient_on(self, indices: Sequence[int]) -> Array:
        """Pull (unknowns,) that corrects for the noise of the regressors, see ``spectral_weights.noise_gradient``.

        ``indices`` are the entries of the parameter vector that come before the nuisance parameters.
        """
        pull = np.zeros(len(indices) + self.stacked[0].size)
        for number, flight in enumerate(self.flights):
            entries, count = [*indices, *flight.nuisances.indices], flight.model.windows.count
            own = noise_gradient(flight.model, flight.power, flight.point, entries, count)
            pull[self.places_of(number, len(indices))] += own
        return pull

    def places_of(self, number: int, values: int) -> NDArray[np.intp]:
        """Places among all unknowns of so many values and of one flight's nuisance parameters."""
        return np.concatenate([np.arange(values), values + self.flights[number].nuisances.places(number)])

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of unknowns: of the candidates, shared by the flights, and of each flight alone."""
        shared = int(self.nuisances.shared.sum())
        return len(self.indices), shared, len(self.nuisances.indices) - shared

    def at(self, points: Sequence[Array]) -> CandidateFit:
        """The same fit with other parameters (P,) by flight, not linearised anew."""
        return replace(self, flights=tuple(f.at(p) for f, p in zip(self.flights, points, strict=True)))

    def with_powers(self, powers: Sequence[Array]) -> CandidateFit:
        """The same fit with weights from other powers (L, 12) by flight, not linearised anew."""
        flights = zip(self.flights, powers, strict=True)
        return replace(self, flights=tuple(replace(flight, power=power) for flight, power in flights))


def unfitted(models: Sequence[ResidualModel], nuisances: Nuisances) -> CandidateFit:
    """The start of a fit of nuisance parameters alone: no candidate, everything neutral."""
    flights = []
    for model in models:
        neutral = model.simulator.neutral()
        flights.append(FlightFit(model, nuisances, neutral, residual_power(model, model.residual(neutral), neutral)))
    return CandidateFit(tuple(flights), ())


def with_candidates(
    fit: CandidateFit, candidates: Sequence[Candidate], nuisances: Nuisances, start: Sequence[float]
) -> CandidateFit:
    """The start of a fit of another set of candidates: those that ``fit`` has stay where they are.

    Parameters of new candidates begin at ``start``; everything else is neutral, because what made up for an effect
    would hide it. ``nuisances`` are those of the nuisance parameters alone, from which the candidates' own are taken.
    """
    names, neutral = fit.simulator.names, fit.simulator.neutral()
    widened = tuple(i for c in candidates for i in c.widened)
    kept = nuisances.without(frozenset(c.effect for c in candidates), names, widened)
    old, chosen = set(fit.indices), {i for c in candidates for i in c.indices}
    reset = list((old | set(fit.nuisances.indices)) - chosen)
    new = [i for c in candidates for i in c.indices if i not in old]
    flights = []
    for flight in fit.flights:
        point = flight.point.copy()
        point[reset] = neutral[reset]
        point[new] = list(start)
        flights.append(FlightFit(flight.model, kept, point, flight.power))
    return CandidateFit(tuple(flights), tuple(candidates))


def stepped(fit: CandidateFit, step: Array) -> CandidateFit:
    """The fit with all unknowns moved by a step (unknowns,), within their bounds and limits; not linearised anew."""
    chosen = list(fit.indices)
    low, high = bounds(fit.simulator, chosen)
    points = []
    for number, flight in enumerate(fit.flights):
        indices, limit = list(flight.nuisances.indices), flight.nuisances.limit
        point = flight.point.copy()
        point[chosen] = np.clip(flight.point[chosen] + step[: len(chosen)], low, high)
        centre = fit.simulator.neutral()[indices]
        moved = flight.point[indices] - centre + step[len(chosen) + flight.nuisances.places(number)]
        point[indices] = centre + np.clip(moved, -limit, limit)
        points.append(point)
    return fit.at(points)


def linearised(fit: CandidateFit) -> CandidateFit:
    """The fit with its residual, slopes, information and cost where it stands.

    The slope of an onset is set to zero: it is a delta function in time, and would make all other unknowns as
    uncertain as the onset is.
    """
    chosen, flights = list(fit.indices), []
    for number, flight in enumerate(fit.flights):
        nuisances = flight.nuisances
        raw = real_rows(flight.model.slopes(flight.point, [*chosen, *nuisances.indices]), flight.weights)
        raw[..., onset_places(fit)] = 0.0
        rows = real_rows(flight.residual, flight.weights)
        columns = raw[..., len(chosen) :].reshape(-1, len(nuisances.indices))
        wide = nuisances.among_all(columns, number, len(fit.flights))
        slopes = np.concatenate([raw[..., : len(chosen)], wide.reshape(*raw.shape[:2], -1)], axis=2)
        flights.append(replace(flight, rows=rows, slopes=slopes))
    information = fit.prior_information
    for flight in flights:
        flat = flight.slopes.reshape(-1, flight.slopes.shape[2])
        information += flat.T @ flat
    cost = sum(float(np.sum(flight.rows**2)) for flight in flights) - 2.0 * fit.prior_score
    return replace(fit, flights=tuple(flights), information=information, cost=cost)


def onset_places(fit: CandidateFit) -> list[int]:
    """Places among the unknowns of the times at which an effect begins."""
    return [place for place, i in enumerate(fit.indices) if fit.simulator.parameters[i][1].name == "onset"]


def step_limits(fit: CandidateFit) -> tuple[Array, Array]:
    """Least and greatest step (unknowns,) of each unknown within its limits; parameters that only shape an effect stay.

    Part of a flight may contain no information on an onset, and a linear step of it would then lead anywhere.
    """
    low, high = bounds(fit.simulator, fit.indices)
    now, _, limit = fit.stacked
    least, greatest = (np.where(fit.sizing, end - fit.values, 0.0) for end in (low, high))
    return np.append(least, -limit - now), np.append(greatest, limit - now)
