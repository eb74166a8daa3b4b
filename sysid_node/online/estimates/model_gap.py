"""How far the flight is from the aircraft file's model, live."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.estimates.current_solution import CurrentSolution, growth_since, slope_variances
from sysid_node.online.regression import least_squares
from sysid_node.online.state import EstimatorState

Array = NDArray[np.float64]


class CoefficientGap(NamedTuple):
    """One coefficient's gap, in the band of the lines; offsets are not compared."""

    coefficient: str
    gap_std: float  # flight minus the file's model
    noise_std: float  # the same with the derivatives refitted: what no change of derivatives removes
    relative: float  # gap over the coefficient's own standard deviation
    derivative: str  # the one that lies furthest from its value in the file
    deviation: float  # ... in standard errors of the difference, tolerance included; NaN = not known


def model_gap(state: EstimatorState, current: CurrentSolution | None) -> list[CoefficientGap]:
    """Gap of every coefficient whose equation can be formed, at the moment ``current``; empty before there is one."""
    latest = state.latest
    if current is None or latest is None or not current.solution.usable:
        return []
    equations, (values, precisions) = state.equations, state.model.prior
    structure = equations.structure
    start, _, stop = state.model.settings.frequencies
    per_energy = 2.0 * (stop - start) / max(float(latest.total.traces.sum()), 1e-12)
    gram, theta = current.gram, current.solution.theta
    v = least_squares.residual_combinations(equations, values)
    energy = np.maximum(((gram @ v) * v).sum(axis=0), 0.0)
    motion = current.solution.motion
    relative = np.sqrt(np.divide(energy, motion, out=np.full_like(motion, np.nan), where=motion > 0.0))
    growth = growth_since(latest, current.time)
    variances = slope_variances(latest, current.solution.residual, current.size, growth)
    if latest.systematic is not None:
        theta = theta + latest.systematic.correction[:, :-1].T * structure.belongs
        variances = variances + latest.systematic.variance[:, :-1]
    spread = np.sqrt(np.maximum(variances.T, 0.0) + _tolerances(precisions))
    deviations = np.where(structure.belongs > 0.0, np.abs(theta - values) / np.maximum(spread, 1e-300), -1.0)
    worst = deviations.argmax(axis=0).tolist()
    names = [f"{c}_{structure.regressors[i]}" for c, i in zip(structure.coefficients, worst, strict=True)]
    noise = latest.uncertainty.residual_std(stop - start)
    stds = (column.tolist() for column in (np.sqrt(per_energy * energy), noise, relative))
    return list(map(CoefficientGap, structure.coefficients, *stds, names, deviations.max(axis=0).tolist()))


def _tolerances(precisions: Array) -> Array:
    """Squared tolerances; zero where none is stated."""
    return np.divide(1.0, precisions, out=np.zeros_like(precisions), where=precisions > 0.0)
