"""How far the flight is from the aircraft file's model, coefficient by coefficient, as the flight goes on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.estimates import Present, present
from sysid_node.online.estimator import State
from sysid_node.online.types import DerivativeEstimate, Estimates


@dataclass(frozen=True)
class CoefficientGap:
    """Misfit of one coefficient in the frequency band; offsets do not count, they are not in the band."""

    coefficient: str
    gap_std: float  # of flight minus the file's model, dimensionless
    noise_std: float  # of flight minus the fitted model: what no change of derivatives removes
    relative: float  # gap_std over the coefficient's own standard deviation; 0 = the file explains the flight
    derivative: str  # that lies furthest from the file, "" = none is valid
    deviation: float  # of that one, in standard deviations of the difference (the file's tolerance included)


def model_gap(state: State, estimates: Estimates) -> tuple[CoefficientGap, ...]:
    """The gap of each coefficient that is estimated; empty before there is anything to compare.

    ``estimates`` are those of the same state. With the Gram matrix G of the transforms of a coefficient y and its
    regressors X, the file's derivatives theta leave the energy (1, -theta) G (1, -theta)^T (Parseval).
    """
    current = present(state)
    if current is None or not current.solution.usable:
        return ()
    return tuple(_gap(state, current, estimates, c) for c in range(len(state.model.plan.coefficients)))


def _gap(state: State, current: Present, estimates: Estimates, c: int) -> CoefficientGap:
    plan, believed = state.model.plan, state.model.aircraft.derivatives
    coefficient, output, mine = plan.coefficients[c], plan.outputs[c], plan.unknowns(c)
    misfit = np.zeros(current.gram.shape[0])
    misfit[output] = 1.0
    misfit[plan.columns[mine]] = [-believed[f"{coefficient}_{plan.regressors[i]}"].value for i in mine]
    gap, noise = max(float(misfit @ current.gram @ misfit), 0.0), float(current.solution.residual[c])
    motion = float(current.gram[output, output])
    noise_std = estimates.fits[coefficient].residual_std
    furthest, deviation = _furthest(state.model.aircraft, estimates, coefficient)
    return CoefficientGap(
        coefficient=coefficient,
        gap_std=noise_std * math.sqrt(gap / noise) if noise > 0.0 else math.nan,
        noise_std=noise_std,
        relative=math.sqrt(gap / motion) if motion > 0.0 else math.nan,
        derivative=furthest,
        deviation=deviation,
    )


def _furthest(aircraft: Aircraft, estimates: Estimates, coefficient: str) -> tuple[str, float]:
    """The valid derivative of a coefficient that lies furthest from the file, and how far, with its sign."""

    def deviation(estimate: DerivativeEstimate) -> float:
        file = aircraft.derivatives[estimate.name]
        return (estimate.value - file.value) / math.hypot(estimate.standard_error, file.tolerance or 0.0)

    names = (f"{coefficient}_{regressor}" for regressor in aircraft.structure[coefficient])
    valid = [estimates.derivatives[name] for name in names if estimates.derivatives[name].valid]
    deviations = {estimate.name: deviation(estimate) for estimate in valid if estimate.standard_error > 0.0}
    furthest = max(deviations, key=lambda name: abs(deviations[name]), default="")
    return furthest, deviations.get(furthest, math.nan)
