"""How far the flight is from the aircraft file's model, live."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sysid_node.online.present import present
from sysid_node.online.prior import beliefs
from sysid_node.online.state import State


class CoefficientGap(NamedTuple):
    """One coefficient's gap, in the band of the lines; offsets are not compared."""

    coefficient: str
    gap_std: float  # flight minus the file's model
    noise_std: float  # the same with the derivatives refitted: what no change of derivatives removes
    relative: float  # gap over the coefficient's own standard deviation
    derivative: str  # the one that lies furthest from its value in the file
    deviation: float  # ... in standard errors of the difference, tolerance included; NaN = not known


def model_gap(state: State) -> list[CoefficientGap]:
    """Gap of every coefficient whose equation can be formed; empty before there are estimates."""
    current, renewed = present(state), state.renewed
    if current is None or renewed is None or not current.solution.usable[0]:
        return []
    plan = state.plan
    values, precisions = beliefs(state.model.aircraft, plan)
    start, _, stop = state.model.settings.frequencies
    per_energy = 2.0 * (stop - start) / max(float(renewed.total.traces.sum()), 1e-12)
    gram, variance, theta = current.gram[0], current.variance[0], current.solution.theta[0]
    gaps = []
    for c, coefficient in enumerate(plan.coefficients):
        mine, y = plan.unknowns(c), int(plan.outputs[c])
        v = np.zeros(plan.width)
        v[y], v[plan.columns[mine]] = 1.0, -values[mine, c]
        energy, motion = max(float(v @ gram @ v), 0.0), float(gram[y, y])
        spread = np.sqrt(np.maximum(variance[mine, c], 0.0) + _tolerances(precisions[mine, c]))
        deviations = np.abs(theta[mine, c] - values[mine, c]) / np.maximum(spread, 1e-300)
        worst = int(np.argmax(deviations))
        noise = math.sqrt(2.0 * (stop - start) * float(renewed.uncertainty.density[c]))
        relative = math.sqrt(energy / motion) if motion > 0.0 else math.nan
        name = f"{coefficient}_{plan.regressors[mine[worst]]}"
        gap_std = math.sqrt(per_energy * energy)
        gaps.append(CoefficientGap(coefficient, gap_std, noise, relative, name, float(deviations[worst])))
    return gaps


def _tolerances(precisions: np.typing.NDArray[np.float64]) -> np.typing.NDArray[np.float64]:
    """Squared tolerances; zero where none is stated."""
    return np.divide(1.0, precisions, out=np.zeros_like(precisions), where=precisions > 0.0)
