"""What the flights tell of the imperfections that an aircraft may have within its tolerances.

The online estimator passes along the flights and estimates the imperfections along with the derivatives
(``online.systematic``). Flights of the same aircraft share both, so it passes along one after another and solves for
all together. Estimates of single flights cannot be combined afterwards: each is linear about its own solution. Where a
flight tells the sum of two imperfections alone, a servo's lateness and the IMU's say, two flights linearised at
different places seem to tell both (Huang, Mourikis & Roumeliotis, Int. J. Robotics Research 29, 2010, call it
inconsistency by linearisation). Flights with commands and flights with measured positions have no servos in common:
their results, normal distributions, are multiplied, and the tolerances, which both of them hold, count once.

Where a log holds commands slowly, the time of a step is not known within its interval. A flight shows the lateness of
all steps together, and a derivative may rest on a single one: that time is added to the servos' lateness again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.online.state import EstimatorState
from sysid_node.online.systematic.estimation import SystematicErrors
from sysid_node.online.systematic.imperfections import Imperfections, prior


class Imperfection(NamedTuple):
    """One number that is taken as known: the key of its tolerance, and of a servo which of its three parameters.

    ``role``: "source", "lateness" (s), "curvature" (s^2) or "third" (s^3). ``commanded``: whether a servo follows
    commands; what comes after measured positions is something else.
    """

    key: str
    role: str = "source"
    commanded: bool = False

    @property
    def control(self) -> str:
        """The control whose servo it belongs to."""
        return self.key.rpartition(".")[2] if self.role != "source" else ""


@dataclass(frozen=True)
class FlightPosterior:
    """K imperfections after the flights, those of servos from zero on, all others from what was taken as known.

    ``jacobian`` (K, D): by how much one unit of each moves the D derivatives ``names`` of the online estimator.
    """

    imperfections: tuple[Imperfection, ...]
    mean: Array  # (K,)
    covariance: Array  # (K, K)
    names: tuple[str, ...]
    jacobian: Array

    @property
    def errors(self) -> Array:
        """(K,) standard errors."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


class _OneFlight(NamedTuple):
    """What one flight tells in units of the tolerances: information (K, K) without the prior's, and score (K,)."""

    imperfections: tuple[Imperfection, ...]
    sigmas: Array  # (K,)
    expected: Array  # (K,)
    information: Array
    score: Array
    precision: Array  # (K, K) the prior's
    names: tuple[str, ...]
    jacobian: Array  # (K, D) per unit
    seconds: float
    step_time: float  # s, 1 sigma of the time of a step in the commands


def flight_posterior(passes: Sequence[EstimatorState]) -> FlightPosterior | None:
    """The posterior after the ``online_passes`` of all flights; None where all is exact, or none can be used."""
    posteriors = [one for state in passes if (one := _posterior_of(state)) is not None]
    return _combined(posteriors) if posteriors else None


def _posterior_of(state: EstimatorState) -> _OneFlight | None:
    imperfect, latest = state.model.imperfections, state.latest
    if imperfect is None or latest is None or latest.systematic is None:
        return None
    found, table = latest.systematic, state.model.table
    sigmas, centre, precision = prior(imperfect.limited(found.limits), found.lines)
    base = _servos_of_lines(imperfect, found)
    inverse = np.linalg.inv(found.considered.covariance / sigmas / sigmas[:, None])
    jacobian = found.considered.jacobian
    return _OneFlight(
        _named(imperfect, commanded=state.model.sample.commanded),
        sigmas,
        base + centre,
        inverse - precision,
        inverse @ ((found.considered.estimate - centre) / sigmas),
        precision,
        table.names,
        jacobian.reshape(sigmas.size, -1)[:, table.place],
        latest.total.energy,
        imperfect.step_time,
    )


def _servos_of_lines(imperfect: Imperfections, found: SystematicErrors) -> Array:
    """(K,) from where the estimates count: where the estimator had the servos; zero for all else."""
    at = imperfect.timed
    lines = found.lines
    return np.concatenate([np.zeros(len(imperfect.sources)), lines.lateness[at], lines.curvature[at], lines.third[at]])


def _named(imperfect: Imperfections, *, commanded: bool) -> tuple[Imperfection, ...]:
    count, keys = len(imperfect.controls), imperfect.keys
    roles = ["source"] * len(imperfect.sources) + ["lateness"] * count + ["curvature"] * count + ["third"] * count
    return tuple(Imperfection(key, role, commanded and role != "source") for key, role in zip(keys, roles, strict=True))


def _combined(posteriors: Sequence[_OneFlight]) -> FlightPosterior:
    """The product of what all flights tell, with the tolerances of those that name an imperfection first."""
    every = tuple(dict.fromkeys(one for flight in posteriors for one in flight.imperfections))
    K, D = len(every), len(posteriors[0].names)
    sigmas, expected = np.zeros(K), np.zeros(K)
    information, score, jacobian, weight = np.eye(K), np.zeros(K), np.zeros((K, D)), np.zeros(K)
    for flight in posteriors:
        at = np.array([every.index(one) for one in flight.imperfections], np.intp)
        new = sigmas[at] == 0.0
        sigmas[at[new]], expected[at[new]] = flight.sigmas[new], flight.expected[new]
        information[np.ix_(at[new], at[new])] = flight.precision[np.ix_(new, new)]
        ratio = sigmas[at] / flight.sigmas
        information[np.ix_(at, at)] += flight.information * ratio[:, None] * ratio
        # scores count from each flight's own expectation
        moved = (flight.expected - expected[at]) / flight.sigmas
        score[at] += ratio * (flight.score + flight.information @ moved)
        jacobian[at] += flight.seconds * flight.jacobian
        weight[at] += flight.seconds
    covariance = np.linalg.inv(information)
    step_time = max(flight.step_time for flight in posteriors)
    late = np.array([one.role == "lateness" and one.commanded for one in every])
    return FlightPosterior(
        every,
        expected + sigmas * (covariance @ score),
        sigmas[:, None] * covariance * sigmas + np.diag(step_time**2 * late),
        posteriors[0].names,
        jacobian / np.maximum(weight, 1e-9)[:, None],
    )
