"""Bayes factors of changes of the aircraft or its sensors, from an interval of flight.

The whitened residuals of the reference model are summed up by an information matrix J (D, D) and a score v (D,) for the
derivatives. The reference derivatives have a covariance P, which is integrated out:

    J' = J - J (J + P^-1)^-1 J,    v' = v - J (J + P^-1)^-1 v.

A fault shifts the derivatives by s + B phi, phi ~ N(0, diag(spread^2)). The logarithm of its Bayes factor relative to
no fault is, with G = B'J'B and g = B'(v' - J's),

    s'v' - s'J's / 2 + g'(G + L)^-1 g / 2 - log(|G + L| / |L|) / 2,     L = diag(spread^-2),

the generalised likelihood ratio of Willsky & Jones (IEEE Trans. Automatic Control 21, 1976) with a penalty for the
number of parameters (Kass & Raftery, "Bayes factors", J. American Statistical Association 90, 1995).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shift:
    """The shift of the derivatives by a fault: s (D,), B (D, m), and the prior standard deviation of phi (m,)."""

    fixed: Array
    free: Array
    spread: Array


@dataclass(frozen=True)
class Weighed:
    """The logarithm of a Bayes factor, and the estimate of phi with its covariance."""

    factor: float
    size: Array  # (m,)
    covariance: Array  # (m, m)


def marginal(J: Array, v: Array, precision: Array) -> tuple[Array, Array]:
    """J' and v' as defined above; ``precision`` (D, D) is P^-1."""
    solved = np.linalg.solve(J + precision, np.column_stack([J, v]))
    return J - J @ solved[:, :-1], v - J @ solved[:, -1]


def weigh(J: Array, v: Array, shift: Shift, excess: float = 1.0) -> Weighed:
    """The Bayes factor for J' and v', of residuals with ``excess`` times the variance assumed in the whitening."""
    s, B = shift.fixed, shift.free
    pulled = J @ s
    prior = shift.spread**-2
    G = B.T @ J @ B / excess + np.diag(prior)
    g = B.T @ (v - pulled) / excess
    covariance = np.asarray(np.linalg.inv(G), dtype=np.float64)
    size = covariance @ g
    freedom = np.linalg.slogdet(G)[1] - float(np.log(prior).sum())
    factor = float(s @ v - 0.5 * s @ pulled) / excess + 0.5 * float(g @ size) - 0.5 * freedom
    return Weighed(factor, size, covariance)


_IMPOSSIBLE = Weighed(-math.inf, np.empty(0), np.empty((0, 0)))


class ShiftGroup:
    """Shifts with the same number m of free directions, more than one, at ``places`` (n,) among all."""

    def __init__(self, places: NDArray[np.intp], shifts: Sequence[Shift]) -> None:
        self.places = places
        self.shifts = tuple(shifts)
        self.free = np.array([shift.free for shift in shifts])  # (n, D, m)
        self.across = np.ascontiguousarray(self.free.swapaxes(1, 2))  # (n, m, D)
        self.prior = np.array([shift.spread**-2 for shift in shifts])  # (n, m)
        self.ridge = 1e-6 * np.eye(self.prior.shape[1])


class Shifts:
    """Many shifts; those with one free direction stand in arrays side by side, the others in groups of one size."""

    def __init__(self, shifts: Sequence[Shift]) -> None:
        self.each = tuple(shifts)
        single = [i for i, shift in enumerate(shifts) if shift.spread.size == 1]
        self.single = np.array(single, dtype=np.intp)  # (n,)
        sizes = np.array([shift.spread.size for shift in shifts])
        places = [np.flatnonzero(sizes == m) for m in np.unique(sizes[sizes > 1])]
        self.groups = [ShiftGroup(place, [shifts[i] for i in place.tolist()]) for place in places]
        self.fixed = np.column_stack([shifts[i].fixed for i in single])  # (D, n)
        self.free = np.column_stack([shifts[i].free[:, 0] for i in single])  # (D, n)
        self.freedom = np.array([shift.spread.size for shift in shifts])  # (H,)
        self.prior = np.array([shifts[i].spread[0] for i in single]) ** -2  # (n,)


def most(shifts: Shifts, squares: Array, excess: Array) -> Array:
    """(H,) an upper bound of the log Bayes factors of shifts without a fixed part, by their ``score_squares`` (H,).

    It is the maximum of the log likelihood ratio, without the penalty for parameters.
    """
    return np.asarray(0.5 * shifts.freedom * squares / excess)


def weigh_each(
    J: Array, v: Array, shifts: Shifts, excess: Array, worth: NDArray[np.bool_] | None = None
) -> list[Weighed]:
    """``weigh`` for many shifts, each with its own ``excess`` (H,).

    Shifts with several free directions are computed only where ``worth`` (H,) is true; else they count as impossible.
    """
    share = 1.0 / excess[shifts.single]
    JS = J @ shifts.fixed
    G = (shifts.free * (J @ shifts.free)).sum(axis=0) * share + shifts.prior
    g = (shifts.free * (v[:, None] - JS)).sum(axis=0) * share
    factor = (shifts.fixed * (v[:, None] - 0.5 * JS)).sum(axis=0) * share
    factor += 0.5 * g * g / G - 0.5 * np.log(G / shifts.prior)
    rows = zip(shifts.single.tolist(), factor.tolist(), (g / G)[:, None], (1.0 / G)[:, None, None], strict=True)
    found = {i: Weighed(f, size, covariance) for i, f, size, covariance in rows}
    for group in shifts.groups:
        wanted = np.arange(group.places.size) if worth is None else np.flatnonzero(worth[group.places])
        if wanted.size:
            found |= _weigh_group(J, v, group, wanted, excess)
    return [found.get(i, _IMPOSSIBLE) for i in range(len(shifts.each))]


def _weigh_group(J: Array, v: Array, group: ShiftGroup, wanted: NDArray[np.intp], excess: Array) -> dict[int, Weighed]:
    """``weigh`` for the ``wanted`` shifts of a group, by their places among all."""
    places, prior = group.places[wanted], group.prior[wanted]
    G = group.across[wanted] @ J @ group.free[wanted] / excess[places, None, None]
    diagonal = np.arange(prior.shape[1])
    G[:, diagonal, diagonal] += prior
    covariances, freedoms = np.linalg.inv(G), np.linalg.slogdet(G)[1] - np.log(prior).sum(axis=1)
    found = {}
    for i, place, covariance, freedom in zip(wanted.tolist(), places.tolist(), covariances, freedoms, strict=True):
        shift, share = group.shifts[i], float(excess[place])
        pulled = J @ shift.fixed
        g = shift.free.T @ (v - pulled) / share
        size = covariance @ g
        factor = float(shift.fixed @ v - 0.5 * shift.fixed @ pulled) / share
        found[place] = Weighed(factor + 0.5 * float(g @ size) - 0.5 * float(freedom), size, covariance)
    return found


def weigh_loosely(J: Array, v: Array, shift: Shift, precision: Array, looseness: Array, excess: float) -> Weighed:
    """As ``weigh``, with J and v, where a fault may differ from its shift by ``looseness`` (D,), 1 sigma.

    A fault is hardly ever as simple as its hypothesis. Without this allowance, a hypothesis with more parameters would
    win by fitting the difference.
    """
    s, m = shift.fixed, shift.spread.size
    none = _evidence(J / excess, v / excess, precision)
    prior = np.zeros((m + len(v), m + len(v)))
    prior[:m, :m] = np.diag(shift.spread**-2)
    prior[m:, m:] = np.linalg.inv(np.linalg.inv(precision) + np.diag(looseness**2))
    B = np.hstack([shift.free, np.eye(len(v))])
    left = (v - J @ s) / excess
    factor, size, covariance = _evidence(B.T @ J @ B / excess, B.T @ left, prior)
    factor += float(s @ v - 0.5 * s @ J @ s) / excess - none[0]
    return Weighed(factor, size[:m], covariance[:m, :m])


def _evidence(G: Array, g: Array, prior: Array) -> tuple[float, Array, Array]:
    """Log Bayes factor of parameters with a normal prior of this precision against zero; their mean and covariance."""
    covariance = np.asarray(np.linalg.inv(G + prior), dtype=np.float64)
    mean = covariance @ g
    freedom = np.linalg.slogdet(G + prior)[1] - np.linalg.slogdet(prior)[1]
    return 0.5 * float(g @ mean) - 0.5 * float(freedom), mean, covariance


def score_squares(J: Array, v: Array, shifts: Shifts) -> Array:
    """(H,) mean square of the score along each shift: 1 without a fault, where the whitening is right."""
    found = np.empty(len(shifts.each))
    information = (shifts.free * (J @ shifts.free)).sum(axis=0)
    found[shifts.single] = (v @ shifts.free) ** 2 / np.maximum(information, 1e-300)
    for group in shifts.groups:
        G = group.across @ J @ group.free
        scale = 1.0 / np.sqrt(np.maximum(G.diagonal(axis1=1, axis2=2), 1e-300))
        g = (v @ group.free) * scale
        solved = np.linalg.solve(G * (scale[:, :, None] * scale[:, None, :]) + group.ridge, g[:, :, None])[:, :, 0]
        found[group.places] = [float(one @ other) / one.size for one, other in zip(g, solved, strict=True)]
    return found
