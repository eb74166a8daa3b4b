"""A three-level random-effects model with known errors, by restricted maximum likelihood.

Flight i of tail j gives the estimate (Raudenbush & Bryk 2002, Hierarchical Linear Models, ch. 7; Konstantopoulos 2011,
Research Synthesis Methods 2:61)

    y_ij = mu + u_j + v_ij + b_ij z + e_ij,    u_j ~ N(0, tau^2),  v_ij ~ N(0, omega^2),  e_ij ~ N(0, s_ij^2)

with the mean mu of the type, the deviation u of a tail, the scatter v of the flights of one tail beyond their stated
errors, the statistical standard error s and the systematic one b. A systematic error is the same unknown z in all
flights of a tail; a share of its variance (``shared``) is the same in all tails of the type. The flights cannot tell
which share: a common error looks like another mean, and an error of one tail looks like a deviation of that tail.

The two scatters are found on a grid of standard deviations, refined about its best point. Their 95 % intervals are
those of the profile of the restricted likelihood. With few tails the mean has the interval of Hartung & Knapp (2001,
Statistics in Medicine 20:3875) with Student's t, never shorter than that of known scatters (Roever et al. 2015,
BMC Medical Research Methodology 15:99).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from sysid_node.flight.record import Array

_POINTS = 40  # of the grid, a side
_ZOOMS = 3
_LEVEL = 0.95
LEAST_FREEDOM = 10  # of the other tails' flights, from which a tail is held against them alone
_TINY = 1e-9  # smallest share of the systematic variance, so that it can be divided by


@dataclass(frozen=True)
class Scatter:
    """A standard deviation with its 95 % interval, in the unit of the estimates; NaN where it cannot be estimated."""

    value: float
    lower: float
    upper: float


@dataclass(frozen=True)
class TailEffects:
    """What is found of each of J tails."""

    own: Array  # (J,) mean of the tail's flights alone
    own_error: Array  # (J,) its standard error: scatter of flights included, systematic errors not
    level: Array  # (J,) empirical Bayes estimate
    level_error: Array  # (J,) its standard error without systematic errors
    shrinkage: Array  # (J,) weight of the type's mean in it
    systematic: Array  # (J,) typical systematic standard error


@dataclass(frozen=True)
class RandomEffects:
    """The fitted model of N flights of J tails.

    ``mean`` has the standard error ``mean_error`` without and ``total_error`` with systematic errors, and the 95 %
    interval ``lower`` to ``upper`` with them.
    """

    mean: float
    mean_error: float
    total_error: float
    lower: float
    upper: float
    tails: Scatter
    flights: Scatter
    by_tail: TailEffects
    freedom: int  # of the scatter of flights: flights less tails


def fit_random_effects(value: Array, statistical: Array, systematic: Array, tail: NDArray[np.intp]) -> RandomEffects:
    """The model of estimates ``value`` (N,) with standard errors ``statistical`` and ``systematic`` (N,).

    ``tail`` (N,) numbers the tails from 0. The systematic errors count as common to the type, which gives the mean its
    widest interval. The interval of the tails' scatter holds both where they are common and where they are each
    tail's own: its lower end is that of the latter. With one tail, its scatter is NaN. With
    one flight a tail, the scatter of flights is NaN (the two cannot be told apart), and all scatter counts as that of
    tails.

    Raises ValueError where there is no flight or a statistical error is not positive.
    """
    if not value.size or not (statistical > 0.0).all():
        raise ValueError("a random-effects model needs at least one flight and positive statistical errors")
    data = _Data.of(value, statistical, systematic, tail)
    common = _profile(data, shared=1.0)
    own = _profile(data, shared=0.0) if data.J > 1 and systematic.any() else common
    tails = Scatter(common.tau.value, min(own.tau.lower, common.tau.lower), max(own.tau.upper, common.tau.upper))
    return _estimates(data, common, tails)


@dataclass(frozen=True)
class _Data:
    """Centred estimates, and what identifies the scatters."""

    centre: float
    y: Array
    s2: Array
    b: Array
    tail: NDArray[np.intp]
    J: int

    @classmethod
    def of(cls, value: Array, statistical: Array, systematic: Array, tail: NDArray[np.intp]) -> _Data:
        centre = float(np.average(value, weights=statistical**-2.0))
        return cls(centre, value - centre, statistical**2, systematic, tail, int(tail.max()) + 1)

    @property
    def has_tails(self) -> bool:
        """Whether the scatter of tails can be estimated."""
        return self.J > 1

    @property
    def has_flights(self) -> bool:
        """Whether the scatter of one tail's flights can be told from that of tails."""
        return self.y.size > self.J


@dataclass(frozen=True)
class _Profile:
    tau: Scatter
    omega: Scatter


def _profile(data: _Data, shared: float) -> _Profile:
    """Both scatters with their profile intervals."""
    reach = 8.0 * (float(np.sqrt(np.mean(data.y**2))) + float(np.sqrt(np.median(data.s2))) / np.sqrt(data.y.size))
    few = 4.0 if data.J < 5 else 1.0  # of few tails the interval reaches far
    limits = [[0.0, few * reach if data.has_tails else 0.0], [0.0, reach if data.has_flights else 0.0]]
    whole = _grid(*limits[0]), _grid(*limits[1])
    surface = _restricted_likelihood(data, *whole, shared)
    tau, omega = whole
    for _ in range(_ZOOMS):
        k, m = np.unravel_index(int(np.argmax(surface)), surface.shape)
        tau, omega = _around(tau, int(k)), _around(omega, int(m))
        surface = _restricted_likelihood(data, tau, omega, shared)
    k, m = np.unravel_index(int(np.argmax(surface)), surface.shape)
    best = float(tau[k]), float(omega[m])
    fine = [np.unique(np.append(grid, point)) for grid, point in zip(whole, best, strict=True)]
    surface = _restricted_likelihood(data, fine[0], fine[1], shared)
    ends = [_interval(grid, surface.max(axis=1 - i)) for i, grid in enumerate(fine)]
    known = data.has_tails, data.has_flights
    found = [
        Scatter(b, *e) if k else Scatter(np.nan, np.nan, np.nan) for b, e, k in zip(best, ends, known, strict=True)
    ]
    return _Profile(*found)


def _grid(start: float, stop: float) -> Array:
    """Points from ``start`` to ``stop``, closer near the start; one point where the two are equal."""
    return start + (stop - start) * np.linspace(0.0, 1.0, _POINTS) ** 3 if stop > start else np.array([start])


def _around(grid: Array, place: int) -> Array:
    """A finer grid between the neighbours of a point."""
    start, stop = float(grid[max(place - 1, 0)]), float(grid[min(place + 1, grid.size - 1)])
    return np.linspace(start, stop, 13) if stop > start else grid


def _interval(grid: Array, profile: Array) -> tuple[float, float]:
    """Where the profile of the log likelihood lies less than half the 95 % quantile of chi-square below its top."""
    height = profile - profile.max() + 0.5 * stats.chi2.ppf(_LEVEL, 1)
    inside = np.flatnonzero(height >= 0.0)
    first, last = int(inside[0]), int(inside[-1])
    lower = grid[first] if first == 0 else _crossing(grid, height, first - 1)
    upper = grid[last] if last == grid.size - 1 else _crossing(grid, height, last)
    return float(lower), float(upper)


def _crossing(grid: Array, height: Array, k: int) -> float:
    """The zero of the line between two neighbouring points."""
    return float(grid[k] - height[k] * (grid[k + 1] - grid[k]) / (height[k + 1] - height[k]))


def _restricted_likelihood(data: _Data, tau: Array, omega: Array, shared: float) -> Array:
    """Log restricted likelihood (T, W) at standard deviations ``tau`` (T,) and ``omega`` (W,)."""
    return _of_sums(_by_tail(data, tau, omega, shared).sum(axis=-1), shared)


def _by_tail(data: _Data, tau: Array, omega: Array, shared: float) -> Array:
    """What each tail adds to the sums of the likelihood, (6, T, W, J).

    With the columns Z = [1, b] of each tail and D = diag(s^2 + omega^2), a tail's covariance is D + Z G Z'. Its
    inverse and determinant follow from A = Z' D^-1 Z (2, 2) and h = Z' D^-1 y by Woodbury's identity, written out
    entry by entry, for there are many matrices of two by two: W = (G^-1 + A)^-1, and the sums are those of
    A - A W A, h - A W h, and of the tail's own log likelihood (times -2).
    """
    A00, A01, A11, h0, h1, own = _moments(data, omega)  # (W, J)
    t, g = tau[:, None, None] ** 2, 1.0 - shared
    determinant = (1.0 + t * A00) * (1.0 + g * A11) - t * g * A01**2  # of I + G A, (T, W, J)
    W00, W01, W11 = t * (1.0 + g * A11) / determinant, -t * g * A01 / determinant, g * (1.0 + t * A00) / determinant
    p0, p1 = W00 * A00 + W01 * A01, W01 * A00 + W11 * A01
    q0, q1 = W00 * A01 + W01 * A11, W01 * A01 + W11 * A11
    explained = W00 * h0**2 + 2.0 * W01 * h0 * h1 + W11 * h1**2
    return np.stack(
        [
            A00 - A00 * p0 - A01 * p1,
            A01 - A00 * q0 - A01 * q1,
            A11 - A01 * q0 - A11 * q1,
            h0 - p0 * h0 - p1 * h1,
            h1 - q0 * h0 - q1 * h1,
            own - explained + np.log(determinant),
        ]
    )


def _of_sums(sums: Array, shared: float) -> Array:
    """The log restricted likelihood from the tails' sums (6, ...).

    The columns of the type are those of a tail, with a flat prior for the mean and the variance ``shared`` for the
    systematic error that is common to the type.
    """
    H00, H01, H11, g0, g1, own = sums
    H11 = H11 + 1.0 / max(shared, _TINY)
    size = H00 * H11 - H01**2
    fitted = (H11 * g0**2 - 2.0 * H01 * g0 * g1 + H00 * g1**2) / size
    return np.asarray(-0.5 * (own + np.log(size) - fitted))


def _moments(data: _Data, omega: Array) -> tuple[Array, ...]:
    """Entries of Z'D^-1Z and Z'D^-1y, and y'D^-1y + log |D|, by omega and tail, (W, J) each."""
    d = data.s2 + omega[:, None] ** 2  # (W, N)
    products = np.stack([np.ones_like(data.b), data.b, data.b**2, data.y, data.b * data.y])
    belongs = np.eye(data.J)[data.tail]  # (N, J)
    return *((products[:, None] / d) @ belongs), (data.y**2 / d + np.log(d)) @ belongs


def scatter_of_others(
    value: Array, statistical: Array, systematic: Array, tail: NDArray[np.intp], omega: float
) -> Array:
    """The scatter of tails (J,) fitted without each tail in turn, at the scatter ``omega`` of flights."""
    data = _Data.of(value, statistical, systematic, tail)
    tau = np.linspace(0.0, 1.0, 200) ** 2 * 4.0 * float(np.sqrt(np.mean(data.y**2)))
    sums = _by_tail(data, tau, np.array([omega]), 1.0)[:, :, 0, :]  # (6, T, J)
    without = _of_sums(sums.sum(axis=-1, keepdims=True) - sums, 1.0)  # (T, J)
    return np.asarray(tau[without.argmax(axis=0)])


@dataclass(frozen=True)
class FlightScatter:
    """The scatter (J,) of flights of one tail, as the other tails show it, with its degrees of ``freedom`` (J,)."""

    value: Array
    freedom: NDArray[np.intp]


def flight_scatter_of_others(
    value: Array, statistical: Array, systematic: Array, tail: NDArray[np.intp]
) -> FlightScatter:
    """The scatter of flights fitted without each tail in turn, with a level of its own for every tail.

    A tail that changes over time does not widen the scatter that it is held against. Where the other tails have less
    than ``LEAST_FREEDOM`` degrees of freedom, all tails count.
    """
    data = _Data.of(value, statistical, systematic, tail)
    flights = np.bincount(tail, minlength=data.J)
    level = np.bincount(tail, data.y) / flights
    omega = np.linspace(0.0, 1.0, 200) ** 2 * 4.0 * float(np.sqrt(np.mean((data.y - level[tail]) ** 2)))
    each = _of_sums(_by_tail(data, np.zeros(1), omega, 1.0)[:, 0], 1.0)  # (W, J)
    total, degrees = each.sum(axis=1, keepdims=True), flights.sum() - data.J
    freedom = degrees - (flights - 1)
    enough = freedom >= LEAST_FREEDOM
    found = omega[np.where(enough, total - each, total).argmax(axis=0)]
    return FlightScatter(np.asarray(found), np.where(enough, freedom, max(degrees, 1)))


def _estimates(data: _Data, found: _Profile, tails: Scatter) -> RandomEffects:
    """The type's mean and the tails' levels at the scatters that were found."""
    tau2, omega2 = np.nan_to_num(found.tau.value) ** 2, np.nan_to_num(found.omega.value) ** 2
    weight = 1.0 / (data.s2 + omega2)
    information = np.bincount(data.tail, weight, data.J)
    own = np.bincount(data.tail, weight * data.y, data.J) / information
    systematic = np.bincount(data.tail, weight * data.b, data.J) / information
    w = 1.0 / (tau2 + 1.0 / information)
    mean = float(w @ own / w.sum())
    variance, quantile = 1.0 / w.sum(), stats.norm.ppf(0.5 + _LEVEL / 2)
    freedom = data.J - 1 if data.has_tails else data.y.size - 1
    if freedom:
        spread = w @ (own - mean) ** 2 if data.has_tails else weight @ (data.y - mean) ** 2
        variance *= max(float(spread) / freedom, 1.0)
        quantile = stats.t.ppf(0.5 + _LEVEL / 2, freedom)
    common = float(w @ systematic / w.sum())
    half = np.hypot(quantile * np.sqrt(variance), stats.norm.ppf(0.5 + _LEVEL / 2) * common)
    kept = tau2 / (tau2 + 1.0 / information)
    level_error = np.sqrt(kept / information + (1.0 - kept) ** 2 * variance)
    if not data.has_tails:
        kept, level_error = np.ones(1), np.full(1, np.sqrt(variance))
    return RandomEffects(
        mean=data.centre + mean,
        mean_error=float(np.sqrt(variance)),
        total_error=float(np.hypot(np.sqrt(variance), common)),
        lower=data.centre + mean - float(half),
        upper=data.centre + mean + float(half),
        tails=tails,
        flights=found.omega,
        by_tail=TailEffects(
            own=data.centre + own,
            own_error=np.sqrt(1.0 / information),
            level=data.centre + mean + kept * (own - mean),
            level_error=np.asarray(level_error),
            shrinkage=1.0 - kept,
            systematic=systematic,
        ),
        freedom=data.y.size - data.J,
    )
