"""Lookup tables for what derivatives and effects leave of a simulator's coefficients.

The residual of a coefficient is regressed on piecewise linear functions of one variable after another, together with
the coefficient's derivatives, which take the straight part. Airspeed and throttle are also tried together: the thrust
of a propeller depends on both, and either alone may explain next to nothing. Tables are kept where they predict
simulated flight that was not fitted clearly better.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite

import jax.numpy as jnp
import numpy as np

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.aircraft.names import split_derivative
from sysid_node.dynamics.tables import full_thrust
from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import COEFFICIENTS, ResidualModel
from sysid_node.gap.residuals.windowed_spectra import MARGIN
from sysid_node.sim.effects.actuator_lag import first_order_series

#: Points of a table, and the percentiles of the variable between which they lie.
_POINTS, _ENDS = 7, (0.5, 99.5)

#: Times that tables are added to one coefficient, at most.
_MOST = 2

#: Variables by which no derivative of the file need be: V is m/s, the throttle 0 to 1, with the motor's lag.
_OF_THRUST = ("V", "throttle")

#: Share of what is left of a coefficient that a table must remove on flight not fitted, and the least error (rms) that
#: this must be, as a share of the motion.
_SHARE, _LEAST = 0.2, 0.006

#: Ridges on the values and on their second differences, as shares of the regressors' mean square.
_RIDGE, _SMOOTHNESS = 1e-6, 1e-5


@dataclass(frozen=True)
class Residual:
    """What a point of the parameters leaves of flights' coefficients, in the time domain, N samples in all."""

    left: Array  # (N, 6)
    slopes: Array  # (N, 6, D) by each derivative
    measured: Array  # (N, 6)
    thrust: Mapping[str, Array] = field(default_factory=dict)  # (N,) airspeed and throttle, where both are known


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
        left, slopes, thrust = measured - predicted, model.series_by_derivative(point), _thrust(model, point)
        parts.append([each[inner] for each in (left, slopes, measured, thrust)])
    left, slopes, measured, thrust = (np.concatenate(part) for part in zip(*parts, strict=True))
    known = isfinite(full_thrust(models[0].simulator.aircraft)) and all(model.flight.metered for model in models)
    return Residual(left, slopes, measured, dict(zip(_OF_THRUST, thrust.T, strict=True)) if known else {})


def _thrust(model: ResidualModel, point: Array) -> Array:
    """(N, 2) airspeed, m/s, and throttle, 0 to 1, behind the motor's lag at parameters (P,)."""
    simulator = model.simulator
    lag = point[simulator.names.index("motor_lag.time_constant")]
    share = jnp.asarray(model.commands[:, -1] / full_thrust(simulator.aircraft))
    throttle = first_order_series(jnp.asarray(lag), share, jnp.asarray(simulator.step), share[0])
    return np.column_stack([model.record["V"], np.asarray(throttle)])


def curves(aircraft: Aircraft, fitted: Residual, held_out: Residual) -> list[TableCurve]:
    """The tables that predict flight not fitted clearly better."""
    names = list(aircraft.derivatives)
    return [
        curve
        for place, coefficient in enumerate(COEFFICIENTS)
        for curve in _curves_of(aircraft, names, coefficient, *(_of(each, place) for each in (fitted, held_out)))
    ]


@dataclass(frozen=True)
class _Single:
    """One coefficient of a ``Residual``."""

    left: Array  # (N,)
    slopes: Array  # (N, D)
    variables: Array  # (N, 6, D): what multiplies each derivative
    measured: Array  # (N,)
    thrust: Mapping[str, Array]


def _of(residual: Residual, place: int) -> _Single:
    left, slopes, measured = residual.left[:, place], residual.slopes[:, place], residual.measured[:, place]
    return _Single(left, slopes, residual.slopes, measured, residual.thrust)


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
            _power_after(own, [*chosen, *added], fitted, held_out, names)
            for variables in _variables(aircraft)
            if not {c.variable for c in chosen} & {*variables}
            and (added := _empty_tables(coefficient, variables, fitted, names))
        ]
        if not tried:
            break
        power, found = min(tried, key=lambda each: each[0])
        if best - power < max(_SHARE * best, _LEAST**2 * motion):
            break
        best, chosen = power, found
    return chosen


def _variables(aircraft: Aircraft) -> list[tuple[str, ...]]:
    """Variables over which tables are tried: each alone, and those of the thrust together."""
    return [*((name,) for name in ("alpha", "beta", *aircraft.control_symbols, *_OF_THRUST)), _OF_THRUST]


def _series(variable: str, single: _Single, names: Sequence[str]) -> Array | None:
    """A variable (N,): the slope of a coefficient by its derivative with respect to the variable."""
    if variable in _OF_THRUST:
        return single.thrust.get(variable)
    for i, name in enumerate(names):
        coefficient, regressor = split_derivative(name)
        if regressor == variable:
            return np.asarray(single.variables[:, COEFFICIENTS.index(coefficient), i])
    return None


def _empty_tables(
    coefficient: str, variables: Sequence[str], single: _Single, names: Sequence[str]
) -> list[TableCurve]:
    """A table of zeros over each variable; none at all where one is not known or does not move."""
    tables = [_empty(coefficient, variable, _series(variable, single, names)) for variable in variables]
    found = [table for table in tables if table is not None]
    return found if len(found) == len(tables) else []


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
    return power, [replace(c, values=_bent(c, v)) for c, v in zip(tables, parts, strict=True)]


def _bent(curve: TableCurve, values: Array) -> Array:
    """The values (K,) without what belongs to the derivatives: their straight part, of thrust their mean."""
    straight = np.polyfit(curve.points, values, 0 if curve.variable in _OF_THRUST else 1)
    return np.asarray(values - np.polyval(straight, curve.points))


def _hats(points: Array, series: Array | None) -> Array:
    """Piecewise linear functions (N, K) that are one at one point each, held beyond the ends."""
    assert series is not None
    return np.column_stack([np.interp(series, points, unit) for unit in np.eye(points.size)])
