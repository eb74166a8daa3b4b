"""Lookup tables for what derivatives and effects leave of a simulator's coefficients.

The residual of a coefficient is regressed on piecewise linear functions of one variable after another, together with
the coefficient's derivatives, which take the straight part. A table is kept where it predicts simulated flight that was
not fitted clearly better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.aircraft.names import split_derivative
from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import COEFFICIENTS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import MARGIN

#: Points of a table, and the percentiles of the variable between which they lie.
_POINTS, _ENDS = 7, (0.5, 99.5)

#: Tables of one coefficient, at most.
_MOST = 2

#: Share of what is left of a coefficient that a table must remove on flight not fitted, and the least error (rms) that
#: this must be, as a share of the motion.
_SHARE, _LEAST = 0.2, 0.006

#: Ridges on the values and on their second differences, as shares of the regressors' mean square.
_RIDGE, _SMOOTHNESS = 1e-6, 1e-5


class Residual(NamedTuple):
    """What a point of the parameters leaves of flights' coefficients, in the time domain, N samples in all."""

    left: Array  # (N, 6)
    slopes: Array  # (N, 6, D) by each derivative
    measured: Array  # (N, 6)


@dataclass(frozen=True)
class TableCurve:
    """A table over one variable: its points, its values, and the variable's name."""

    coefficient: str
    variable: str
    points: Array
    values: Array

    @property
    def table(self) -> LookupTable:
        """As an aircraft file holds it."""
        return LookupTable(
            self.coefficient, (self.variable,), (tuple(self.points.tolist()),), tuple(self.values.tolist())
        )


def residual_of(models: Sequence[ResidualModel], points: Sequence[Array]) -> Residual:
    """What parameters (P,) by flight leave of these flights."""
    parts = []
    for model, point in zip(models, points, strict=True):
        inner = slice(round(MARGIN * model.simulator.rate), -round(MARGIN * model.simulator.rate))
        predicted = model.predicted_series(point)[:, : len(COEFFICIENTS)]
        measured = model.series[:, : len(COEFFICIENTS)]
        parts.append(((measured - predicted)[inner], model.series_by_derivative(point)[inner], measured[inner]))
    return Residual(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def curves(aircraft: Aircraft, fitted: Residual, held_out: Residual) -> list[TableCurve]:
    """The tables that predict flight not fitted clearly better."""
    names = list(aircraft.derivatives)
    return [
        curve
        for place, coefficient in enumerate(COEFFICIENTS)
        for curve in _curves_of(aircraft, names, coefficient, *(_of(each, place) for each in (fitted, held_out)))
    ]


class _Single(NamedTuple):
    """One coefficient of a ``Residual``."""

    left: Array  # (N,)
    slopes: Array  # (N, D)
    variables: Array  # (N, 6, D): what multiplies each derivative
    measured: Array  # (N,)


def _of(residual: Residual, place: int) -> _Single:
    return _Single(residual.left[:, place], residual.slopes[:, place], residual.slopes, residual.measured[:, place])


def _curves_of(
    aircraft: Aircraft, names: Sequence[str], coefficient: str, fitted: _Single, held_out: _Single
) -> list[TableCurve]:
    """The tables of one coefficient, added one after another."""
    own = [i for i, name in enumerate(names) if split_derivative(name)[0] == coefficient]
    if not own:
        return []
    motion = float(np.var(held_out.measured))
    chosen: list[TableCurve] = []
    best = _power_after(own, [], fitted, held_out, names)[0]
    for _ in range(_MOST):
        tried = [
            _power_after(own, [*chosen, curve], fitted, held_out, names)
            for variable in _variables(aircraft)
            if variable not in {c.variable for c in chosen}
            and (curve := _empty(coefficient, variable, _series(variable, fitted, names))) is not None
        ]
        if not tried:
            break
        power, found = min(tried, key=lambda each: each[0])
        if best - power < max(_SHARE * best, _LEAST**2 * motion):
            break
        best, chosen = power, found
    return chosen


def _variables(aircraft: Aircraft) -> tuple[str, ...]:
    """Variables over which tables are tried."""
    return ("alpha", "beta", *aircraft.control_symbols)


def _series(variable: str, single: _Single, names: Sequence[str]) -> Array | None:
    """A variable (N,): the slope of a coefficient by its derivative with respect to the variable."""
    for i, name in enumerate(names):
        coefficient, regressor = split_derivative(name)
        if regressor == variable:
            return np.asarray(single.variables[:, COEFFICIENTS.index(coefficient), i])
    return None


def _empty(coefficient: str, variable: str, series: Array | None) -> TableCurve | None:
    """A table of zeros over the range of a variable; none where it is not known or does not move."""
    if series is None:
        return None
    low, high = np.percentile(series, _ENDS)
    if not high - low > 1e-3:
        return None
    return TableCurve(coefficient, variable, np.linspace(low, high, _POINTS), np.zeros(_POINTS))


def _power_after(
    own: Sequence[int], tables: Sequence[TableCurve], fitted: _Single, held_out: _Single, names: Sequence[str]
) -> tuple[float, list[TableCurve]]:
    """Mean square that is left of flight held out with tables fitted, and these."""
    A, H = fitted.slopes[:, own], [_hats(c.points, _series(c.variable, fitted, names)) for c in tables]
    regressors = np.hstack([A, *H])
    size = np.maximum(np.sqrt((regressors**2).mean(axis=0)), 1e-12)
    gram = (regressors / size).T @ (regressors / size) / len(regressors)
    gram += np.diag(np.concatenate([np.full(len(own), 1e-10), np.full(len(tables) * _POINTS, _RIDGE)]))
    bend = np.diff(np.eye(_POINTS), 2, axis=0)
    for k in range(len(tables)):
        block = slice(len(own) + k * _POINTS, len(own) + (k + 1) * _POINTS)
        scaled = bend / size[block]
        gram[block, block] += _SMOOTHNESS * float(np.mean(size[block])) ** 2 * (scaled.T @ scaled)
    values = np.linalg.solve(gram, (regressors / size).T @ fitted.left / len(regressors)) / size
    other = [held_out.slopes[:, own], *(_hats(c.points, _series(c.variable, held_out, names)) for c in tables)]
    power = float(np.mean((held_out.left - np.hstack(other) @ values) ** 2))
    parts = [values[len(own) + k * _POINTS : len(own) + (k + 1) * _POINTS] for k in range(len(tables))]
    return power, [replace(c, values=_bent(c.points, v)) for c, v in zip(tables, parts, strict=True)]


def _bent(points: Array, values: Array) -> Array:
    """The values (K,) without their straight part, which belongs to the derivatives."""
    return np.asarray(values - np.polyval(np.polyfit(points, values, 1), points))


def _hats(points: Array, series: Array | None) -> Array:
    """Piecewise linear functions (N, K) that are one at one point each, held beyond the ends."""
    assert series is not None
    return np.column_stack([np.interp(series, points, unit) for unit in np.eye(points.size)])
