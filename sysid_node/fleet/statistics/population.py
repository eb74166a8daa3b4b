"""The population of one derivative: the type's mean, the tails about it, and the flights of each tail."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from sysid_node.fleet.statistics.random_effects import RandomEffects, fit_random_effects, scatter_of_others
from sysid_node.fleet.statistics.series import DerivativeSeries
from sysid_node.flight.record import Array

#: Tails besides the one in question from which their scatter is known well enough to compare a tail with it.
_LEAST_OTHERS = 3


@dataclass(frozen=True)
class Population:
    """One derivative of one type: its flights, freed of drift, and the model fitted to them.

    ``apart`` (J,) is how far each tail's own mean lies from the mean of the other tails, ``apart_error`` (J,) the
    standard error of that distance with the scatter of the other tails, and ``apart_p`` (J,) its p-value (Student's
    t; NaN with fewer than three other tails). ``fleet_weight`` (N,) is the weight that the fleet has in the
    combination of each flight's estimate with what the fleet's other flights tell of its tail.
    """

    series: DerivativeSeries
    fit: RandomEffects
    apart: Array
    apart_error: Array
    apart_p: Array
    fleet_weight: Array

    @property
    def key(self) -> tuple[str, str]:
        """Type and derivative."""
        return self.series.aircraft, self.series.name


def population_of(series: DerivativeSeries) -> Population:
    """The population of the series of one type and derivative."""
    fit = fit_random_effects(series.value, series.statistical, series.systematic, series.tail)
    return Population(series, fit, *_apart(series, fit), _fleet_weight(series, fit))


def _apart(series: DerivativeSeries, fit: RandomEffects) -> tuple[Array, Array, Array]:
    """Distance (J,) of each tail from the others, its standard error and its p-value.

    The others' scatter is fitted without the tail, so that a tail that stands out does not hide itself.
    """
    J = len(series.tails)
    if J - 1 < _LEAST_OTHERS:
        return np.full(J, np.nan), np.full(J, np.nan), np.full(J, np.nan)
    omega = float(np.nan_to_num(fit.flights.value))
    tau = scatter_of_others(series.value, series.statistical, series.systematic, series.tail, omega)
    variance = (
        tau[:, None] ** 2 + fit.by_tail.own_error**2
    )  # (J, J): of each tail's own mean, one tail left out in each row
    weight = (1.0 - np.eye(J)) / variance
    others = weight @ fit.by_tail.own / weight.sum(axis=1)
    spread = (weight * (fit.by_tail.own - others[:, None]) ** 2).sum(axis=1) / (J - 2)
    others_variance = np.maximum(spread, 1.0) / weight.sum(axis=1)
    distance, error = fit.by_tail.own - others, np.sqrt(np.diag(variance) + others_variance)
    return distance, error, np.asarray(2.0 * stats.t.sf(np.abs(distance) / error, J - 2))


def _fleet_weight(series: DerivativeSeries, fit: RandomEffects) -> Array:
    """Weight (N,) of the fleet's other flights in each flight's combined estimate.

    The systematic error is common to both and drops out of the weights.
    """
    omega2, tau2 = np.nan_to_num(fit.flights.value) ** 2, np.nan_to_num(fit.tails.value) ** 2
    information = np.bincount(series.tail, 1.0 / (series.statistical**2 + omega2))[series.tail]
    others = np.maximum(information - 1.0 / (series.statistical**2 + omega2), 0.0)
    level = 1.0 / (others + 1.0 / (tau2 + fit.mean_error**2))
    prior = level + omega2
    return np.asarray(series.statistical**2 / (series.statistical**2 + prior))
