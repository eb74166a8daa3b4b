"""Any linear regression by the estimator's own transform and least squares, as the field's programs state theirs.

The estimator knows six coefficients. Others regress rates of change on motions in dimensional form, such as the rate of
the angle of attack on angle of attack, pitch rate and elevator; this puts such signals in the six coefficients' places.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.online.frequency import fourier_transform
from sysid_node.online.frequency.fourier_transform import Lines
from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout
from sysid_node.online.regression import information, least_squares, normal_equations
from sysid_node.online.regression.information import Information, Spectrum

Array = NDArray[np.float64]
Frequencies = tuple[float, float, float]  # Hz: first, step, last


class Value(NamedTuple):
    """An estimate with its standard error."""

    value: float
    error: float


def regress(
    time: Array,
    left: Mapping[str, Array],
    regressors: Mapping[str, Array],
    frequencies: Frequencies,
    *,
    rates: bool = False,
    breaks: Sequence[float] = (),
) -> dict[str, Value]:
    """``<equation>_<regressor>`` for every equation in ``left`` on all ``regressors``; signals (N,) at times (N,) s.

    ``rates``: the left sides are the signals' rates of change. ``breaks`` (s): where the record begins anew.
    """
    layout = SignalLayout(tuple(regressors))
    plan = normal_equations.normal_equations(dict.fromkeys(COEFFICIENTS[: len(left)], tuple(regressors)), layout)
    grid = fourier_transform.lines(*frequencies)
    lines = information.spectrum(grid.omega, np.inf)
    total = information.nothing(layout)
    for part in _parts(time, breaks):
        columns = _columns(layout, time[part], {n: x[part] for n, x in regressors.items()})
        sides = np.array([x[part] for x in left.values()])
        total = total + _measure(time[part], columns, sides, rates, grid, lines)
    solution = least_squares.solve(plan, total.grams.sum(axis=0))
    spread = least_squares.uncertainty(plan, solution, total)
    errors = np.sqrt(spread.covariance.diagonal(axis1=1, axis2=2))
    return {
        f"{equation}_{plan.structure.regressors[i]}": Value(float(solution.theta[i, c]), float(errors[c, i]))
        for c, equation in enumerate(left)
        for i in plan.structure.unknowns(c)
    }


def _parts(time: Array, breaks: Sequence[float]) -> list[slice]:
    edges = [0, *np.searchsorted(time, breaks).tolist(), time.size]
    return [slice(a, b) for a, b in pairwise(edges)]


def _columns(layout: SignalLayout, time: Array, regressors: Mapping[str, Array]) -> Array:
    """(N, W) signals, the left sides still zero; nothing is weighed by the dynamic pressure."""
    columns = np.zeros((time.size, layout.transformed))
    columns[:, OFFSET] = columns[:, OFFSET + 1] = 1.0
    columns[:, OFFSET + 2] = time
    for name, signal in regressors.items():
        columns[:, layout.column(name)] = signal
    return columns


def _measure(time: Array, columns: Array, sides: Array, rates: bool, grid: Lines, lines: Spectrum) -> Information:
    """What one uninterrupted part says; sides (equations, N)."""
    if not rates:
        columns[:, : len(sides)] = sides.T
    step = np.diff(time)[:, None]
    areas, slants = 0.5 * step * (columns[1:] + columns[:-1]), 0.5 * step**2 * np.diff(columns, axis=0)
    if rates:
        areas[:, : len(sides)] = np.diff(sides, axis=1).T
    running = fourier_transform.start(grid, columns.shape[1])
    fourier_transform.add(running, time[:-1].tolist(), time[1:].tolist(), areas, slants)
    return information.measure(fourier_transform.current(running), None, lines, float(time[0]), float(time[-1]))
