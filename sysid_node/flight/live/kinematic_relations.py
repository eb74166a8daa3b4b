"""What a flight's instruments say of the same motion: regressions between what the kinematics make equal.

Over each half second the change of an angle is the integral of its rates, and what the accelerometers integrate to is
the change of the air's velocity and what the rotation turns of it (Klein & Morelli, "Aircraft System Identification"
(2006), ch. 10). Each relation is a regression with one slope that is 1 where all is right, -1 where one of its readings
has the wrong sign, and a unit's factor where one has another unit. Biases and the arms of the instruments are regressed
along. Noise and wind reduce the slopes. Wind that the aircraft answers may turn the sign of one, but then the readings
are hardly correlated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.flight.record import Array

SPAN = 0.5  # s over which the readings are integrated
_LONGEST_STEP = 0.2  # s from sample to sample within a span
_FEWEST = 20  # degrees of freedom from which on a relation tells
_NOTHING = 1e-9  # share of a column's power under which what is left of it is rounding
_MOST = 1.0 - 1e-12  # correlation: Fisher's z has an end
_READINGS = 13  # of a sample, its time included

_LAGS = (*range(-5, 0), *range(1, 6))  # tenths of a second, a span at most
_SHIFTED = tuple(f"{change}_{lag}" for lag in _LAGS for change in ("d_v", "d_w"))  # flow angles so much later
#: What is known of each span: how long it is, changes (d_) and integrals. u, v, w: velocity along body x, y, z, m/s.
_COLUMNS = (
    *("time", "d_phi", "d_theta", "d_psi", "d_p", "d_q", "d_r", "d_v", "d_w"),
    *("phi_rate", "theta_rate", "psi_rate", "force_y", "force_z", "qu", "ru", "pv", "pw"),
    *_SHIFTED,
)
_PLACE = {name: i for i, name in enumerate(_COLUMNS)}


class _Relation(NamedTuple):
    """Sums of columns whose regression has the slope 1, and the columns that are regressed along."""

    response: dict[str, float]
    regressor: dict[str, float]
    along: tuple[str, ...] = ()


RELATIONS = {
    "roll": _Relation({"d_phi": 1.0}, {"phi_rate": 1.0}),
    "pitch": _Relation({"d_theta": 1.0}, {"theta_rate": 1.0}),
    "yaw": _Relation({"d_psi": 1.0}, {"psi_rate": 1.0}),
    # dw/dt = az + g cos(phi) cos(theta) + q u - p v, dv/dt = ay + g sin(phi) cos(theta) - r u + p w
    "vertical": _Relation({"force_z": 1.0, "pv": -1.0}, {"qu": -1.0}, ("time", "d_p", "d_q", "d_w")),
    "lateral": _Relation({"force_y": 1.0}, {"ru": 1.0}, ("time", "d_p", "d_r", "d_v", "pw")),
    "alpha": _Relation({"force_z": 1.0, "qu": 1.0, "pv": -1.0}, {"d_w": 1.0}, ("time", "d_p", "d_q")),
    "beta": _Relation({"force_y": 1.0, "ru": -1.0, "pw": 1.0}, {"d_v": 1.0}, ("time", "d_p", "d_r")),
}


class Agreement(NamedTuple):
    """What the spans say of a relation."""

    slope: float = 0.0  # of the response by the regressor: too small where noise is in the regressor
    inverse: float = 0.0  # of the regressor by the response: too small where noise is in the response
    score: float = 0.0  # standard deviations by which the correlation is not zero (Fisher's z), with its sign

    @property
    def correlation(self) -> float:
        """-1 to 1."""
        return math.copysign(math.sqrt(self.slope * self.inverse), self.slope)


class KinematicRelations:
    """The regressions of a flight that comes in pieces."""

    def __init__(self) -> None:
        self._gram = np.zeros((len(_COLUMNS), len(_COLUMNS)))
        self._counts = np.zeros(len(_COLUMNS))  # spans in which each column is known
        self._rest = np.empty((0, _READINGS))  # samples since the end of the last span that was looked at

    def add(self, time: Array, motion: Array, air: Array, attitude: Array) -> None:
        """Count samples (N,) at increasing times, s, in body axes forward, right, down.

        ``motion`` (N, 6): specific force m/s^2 and rates rad/s; ``air`` (N, 3): airspeed m/s, angle of attack and
        sideslip rad; ``attitude`` (N, 3): roll, pitch and heading, rad. What is not measured is NaN.
        """
        samples = np.concatenate([self._rest, np.column_stack([time, motion, air, attitude])])
        if len(samples) < 2:
            self._rest = samples
            return
        _, ends = np.unique(samples[:, 0] // SPAN, return_index=True)  # so that pieces of any length give the same
        if ends.size < 5:  # the last span is not complete, and flow angles up to a span before and after are looked at
            self._rest = samples
            return
        self._rest = samples[ends[-4] :]
        spans, known = _spans(_without_still_attitude(samples, ends), ends[1:-2])
        self._gram += spans.T @ spans
        self._counts += known.sum(axis=0)

    def shifted(self, relation: str) -> float:
        """The largest correlation of "alpha" or "beta" by flow angles that come up to a span late or early."""
        (change,) = RELATIONS[relation].regressor
        return max(self.agreement(relation, {f"{change}_{lag}": 1.0}).correlation for lag in _LAGS)

    def agreement(self, relation: str, other: Mapping[str, float] | None = None) -> Agreement:
        """What the flight so far says of a relation, or by an ``other`` regressor; zeros where that is too little."""
        response, regressor, along = RELATIONS[relation]
        both = np.zeros((len(_COLUMNS), 2))
        for i, terms in enumerate((response, other or regressor)):
            both[[_PLACE[name] for name in terms], i] = list(terms.values())
        places = [_PLACE[name] for name in along]
        freedom = self._counts[both.any(axis=1)].min() - len(along) - 3
        if freedom < _FEWEST:
            return Agreement()
        own, cross = both.T @ self._gram @ both, self._gram[places] @ both
        left = own - cross.T @ np.linalg.pinv(self._gram[np.ix_(places, places)], hermitian=True) @ cross
        (yy, xy), (_, xx) = left.tolist()
        if not (xx > _NOTHING * own[1, 1] and yy > _NOTHING * own[0, 0] and xy):
            return Agreement()
        correlation = min(max(xy / math.sqrt(xx * yy), -_MOST), _MOST)
        return Agreement(xy / xx, xy / yy, math.atanh(correlation) * math.sqrt(freedom))


def _without_still_attitude(samples: Array, ends: NDArray[np.intp]) -> Array:
    """The samples, the attitude NaN in spans in which it does not change at all: a field that nobody fills in."""
    angles = samples[ends, 10:12]
    still = np.append((angles[1:] == angles[:-1]).all(axis=1), False)
    found = samples.copy()
    found[np.repeat(still, np.diff(ends, append=len(samples))), 10:] = np.nan
    return found


def _spans(samples: Array, ends: NDArray[np.intp]) -> tuple[Array, NDArray[np.bool_]]:
    """The columns (S, C) of the spans between the samples ``ends`` (S + 1,), and which of them are known.

    Zeros stand for what is not known: they take no part in the sums.
    """
    time, within = samples[:, 0], slice(int(ends[0]), int(ends[-1]) + 1)
    changing, integrands = _columns(samples)
    steps, values, starts = np.diff(time[within]), integrands[within], ends[:-1] - ends[0]
    trapezoids = 0.5 * (values[1:] + values[:-1]) * steps[:, np.newaxis]
    velocities = changing[:, [_PLACE["d_v"], _PLACE["d_w"]]].T
    shifted = [np.interp(time[ends] + 0.1 * lag, time, each) for lag in _LAGS for each in velocities]
    changes, shifts = np.diff(changing[ends], axis=0), np.diff(shifted, axis=1).T
    spans = np.column_stack([changes, np.add.reduceat(trapezoids, starts), shifts])
    headings = spans[:, _PLACE["d_psi"]]
    headings -= 2.0 * math.pi * np.round(headings / (2.0 * math.pi))
    moving = np.isfinite(spans[:, [_PLACE["force_z"], _PLACE["qu"]]]).all(axis=1)
    spans = spans[moving & (np.maximum.reduceat(steps, starts) <= _LONGEST_STEP)]
    known = np.isfinite(spans)
    return np.where(known, spans, 0.0), known


def _columns(samples: Array) -> tuple[Array, Array]:
    """Of samples (N, readings) the columns whose changes (N, 9), and those whose integrals (N, 9) are looked at."""
    time, _, ay, az, p, q, r, airspeed, alpha, beta, phi, theta, psi = samples.T
    tilted, inclined, sideways = (np.isfinite(angle) for angle in (phi + theta, alpha, beta))
    flow = (airspeed, np.where(inclined, alpha, 0.0), np.where(sideways, beta, 0.0))
    u, v, w = velocity_of(flow, np)
    sin, cos, weight = np.sin(phi), np.cos(phi), GRAVITY * np.cos(theta)
    turn = q * sin + r * cos
    changing = [time, phi, theta, psi, p, q, r, np.where(sideways, v, np.nan), np.where(inclined, w, np.nan)]
    rates = [p + np.tan(theta) * turn, q * cos - r * sin, turn / np.cos(theta)]
    forces = [ay + weight * sin, az + np.where(tilted, weight * cos, GRAVITY)]
    turned = [q * u, np.where(tilted, r * u, np.nan), p * v, np.where(tilted, p * w, np.nan)]
    return np.column_stack(changing), np.column_stack([*rates, *forces, *turned])
