"""What the fleet knows of one tail before its next flight: an aircraft file, and how an estimate combines with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.fleet.statistics.drift import Drift
from sysid_node.fleet.statistics.population import Population


@dataclass(frozen=True)
class TailPrior:
    """One derivative of one tail as its next flight should find it.

    ``error`` is the standard error without the systematic part, ``systematic`` that part, which a further estimate of
    the same tail shares. ``shrinkage`` is the weight of the type's mean, ``flights`` the number of the tail's own.
    """

    value: float
    error: float
    systematic: float
    shrinkage: float
    flights: int

    @property
    def tolerance(self) -> float:
        """How far the true value may be off, 1 sigma."""
        return float(np.hypot(self.error, self.systematic))

    def combined(self, value: float, statistical: float) -> tuple[float, float, float]:
        """Value, standard error and the prior's weight, of an estimate combined with the prior.

        ``statistical`` is the estimate's standard error without its systematic part. That part is the same unknown in
        the prior, so that it does not count for the weights, and comes back in the error of the result.
        """
        weight = statistical**2 / (statistical**2 + self.error**2)
        error = np.hypot(np.sqrt(weight) * self.error, self.systematic)
        return (1.0 - weight) * value + weight * self.value, float(error), float(weight)


def tail_prior(population: Population, tail: str, drift: Drift | None) -> TailPrior:
    """The prior for the next flight of a tail that the population holds.

    Empirical Bayes (Morris 1983, J. Am. Stat. Assoc. 78:47): the tail's level, moved by its ``drift`` to the last
    flight's date, within the scatter of flights.
    """
    fit = population.fit
    j = population.series.tails.index(tail)
    value, variance = (
        float(fit.by_tail.level[j]),
        float(fit.by_tail.level_error[j] ** 2 + np.nan_to_num(fit.flights.value) ** 2),
    )
    if drift is not None:
        value += drift.change * float(drift.course.values[-1])
        variance += drift.error**2
    count = int((population.series.tail == j).sum())
    return TailPrior(
        value, float(np.sqrt(variance)), float(fit.by_tail.systematic[j]), float(fit.by_tail.shrinkage[j]), count
    )


def tail_aircraft(file: Aircraft, tail: str, priors: Mapping[str, TailPrior]) -> Aircraft:
    """The type's aircraft file with the fleet's values and tolerances of one tail; the rest stays the file's."""
    derivatives = {
        name: Derivative(priors[name].value, priors[name].tolerance) if name in priors else derivative
        for name, derivative in file.derivatives.items()
    }
    known = [name for name in file.derivatives if name in priors]
    count = max((priors[name].flights for name in known), default=0)
    source = f"{len(known)} derivatives of tail {tail} from its {count} flights and its type's; the rest: {file.source}"
    return replace(file, derivatives=derivatives, source=source)
