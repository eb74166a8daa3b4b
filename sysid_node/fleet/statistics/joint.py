"""The random-effects model of several derivatives at once, with the full covariances of the estimates' errors.

The model of ``random_effects`` with vectors (p,) for a flight's estimates, and matrices T (p, p) of the scatter of
tails and Omega (p, p) of the scatter of flights. Derivatives of one coefficient have correlated errors; a derivative
that one flight does not excite then borrows from the others. T and Omega maximise the restricted likelihood, by the
expectation-maximisation algorithm with the mean integrated out (Laird & Ware 1982, Biometrics 38:963; Jackson, Riley &
White 2011, Statistics in Medicine 30:2481, for the multivariate meta-analysis).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.fleet.results import FlightResult
from sysid_node.flight.record import Array

_STEPS = 200
_SETTLED = 5e-4  # relative change of the standard deviations in a step
_UNKNOWN = 1e6  # times the largest variance: that of an estimate that is not valid


@dataclass(frozen=True)
class JointEffects:
    """Of p derivatives of one type and J tails.

    ``mean`` (p,) with ``mean_covariance`` (p, p), which holds the systematic errors as common to the type;
    ``tail_scatter`` and ``flight_scatter`` (p, p) the covariances of tails and of flights of one tail; ``level``
    (J, p) and ``level_covariance`` (J, p, p) the empirical Bayes estimates of the tails, without systematic errors.
    """

    aircraft: str
    names: tuple[str, ...]
    tails: tuple[str, ...]
    mean: Array
    mean_covariance: Array
    tail_scatter: Array
    flight_scatter: Array
    level: Array
    level_covariance: Array


def fit_joint(flights: Sequence[FlightResult], names: Sequence[str]) -> JointEffects | None:
    """The joint model of the derivatives ``names`` from flights of one type; None with fewer than three tails.

    Flights that have none of the derivatives are left out. Flights must be those of one type.
    """
    rows = [row for row in (_row(flight, names) for flight in flights) if row is not None]
    tails = tuple(dict.fromkeys(row[0] for row in rows))
    if len(tails) < 3 or len(rows) < len(tails) + 2:
        return None
    y, S, B = (np.array([row[k] for row in rows]) for k in (1, 2, 3))
    known = np.array([row[4] for row in rows])
    scale = np.sqrt(np.median(np.diagonal(S, axis1=1, axis2=2), axis=0))
    S, B, y = S / np.outer(scale, scale), B / np.outer(scale, scale), y / scale
    centre = np.median(y, axis=0)
    S[~known[:, :, None] & np.eye(len(names), dtype=bool)] = _UNKNOWN
    tail = np.array([tails.index(row[0]) for row in rows], dtype=np.intp)
    fit = _maximise(np.where(known, y - centre, 0.0), S, tail, len(tails))
    units = np.outer(scale, scale)
    return JointEffects(
        flights[0].aircraft, tuple(names), tails, (fit.mean + centre) * scale,
        (fit.mean_covariance + B.mean(axis=0)) * units, fit.T * units, fit.Omega * units,
        (fit.level + centre) * scale, fit.level_covariance * units,
    )  # fmt: skip


def _row(flight: FlightResult, names: Sequence[str]) -> tuple[str, Array, Array, Array, NDArray[np.bool_]] | None:
    """Tail, estimates (p,), statistical and systematic covariance (p, p) and which estimates are known (p,)."""
    places = np.array([flight.names.index(name) if name in flight.names else -1 for name in names])
    S = flight.statistical_covariance[np.ix_(places, places)]
    B = flight.covariance[np.ix_(places, places)] - S
    y = flight.values[places]
    known = (places >= 0) & flight.valid[places] & np.isfinite(y) & np.isfinite(np.diag(S)) & (np.diag(S) > 0.0)
    if not known.any():
        return None
    both = np.outer(known, known)
    return flight.tail, np.where(known, y, 0.0), np.where(both, S, 0.0) + np.diag(~known * 1.0), both * B, known


@dataclass(frozen=True)
class _Fit:
    mean: Array
    mean_covariance: Array
    T: Array
    Omega: Array
    level: Array
    level_covariance: Array


def _maximise(y: Array, S: Array, tail: NDArray[np.intp], J: int) -> _Fit:
    """Steps of expectation and maximisation until the scatters are settled."""
    p = y.shape[1]
    T, Omega = np.eye(p), np.eye(p)
    for _ in range(_STEPS):
        fit, T_next, Omega_next = _step(y, S, tail, J, T, Omega)
        change = max(_change(T, T_next), _change(Omega, Omega_next))
        T, Omega = T_next, Omega_next
        if change < _SETTLED:
            break
    return fit


def _change(before: Array, after: Array) -> float:
    """Largest change of a standard deviation, relative to a typical statistical error (1) or to itself."""
    old, new = np.sqrt(np.diag(before)), np.sqrt(np.diag(after))
    return float((np.abs(new - old) / np.maximum(old, 0.1)).max())


def _step(y: Array, S: Array, tail: NDArray[np.intp], J: int, T: Array, Omega: Array) -> tuple[_Fit, Array, Array]:
    """The estimates at these scatters, and the scatters' next values: mean squares that the data lead to expect."""
    p = y.shape[1]
    D_inverse = np.linalg.inv(S + Omega)  # (N, p, p)
    P, h = np.zeros((J, p, p)), np.zeros((J, p))
    np.add.at(P, tail, D_inverse)
    np.add.at(h, tail, np.einsum("nab,nb->na", D_inverse, y))
    own_covariance = np.linalg.inv(P)
    own = np.einsum("jab,jb->ja", own_covariance, h)
    C = np.linalg.inv(T + own_covariance)  # inverse covariance of the tails' own means
    mean_covariance = np.linalg.inv(C.sum(axis=0))
    mean = mean_covariance @ np.einsum("jab,jb->a", C, own)
    u = np.einsum("ab,jbc,jc->ja", T, C, own - mean)
    R = C - C @ mean_covariance @ C
    T_next = (np.einsum("ja,jb->ab", u, u) + (T - T @ R @ T).sum(axis=0)) / J
    gain = own_covariance @ C
    level_covariance = own_covariance - gain @ own_covariance + gain @ mean_covariance @ np.swapaxes(gain, 1, 2)
    left = np.einsum("nab,nb->na", D_inverse, y - (mean + u)[tail])
    v = left @ Omega
    inner = D_inverse - D_inverse @ level_covariance[tail] @ D_inverse
    Omega_next = (v.T @ v + (Omega - Omega @ inner @ Omega).sum(axis=0)) / y.shape[0]
    return _Fit(mean, mean_covariance, T, Omega, mean + u, level_covariance), T_next, Omega_next
