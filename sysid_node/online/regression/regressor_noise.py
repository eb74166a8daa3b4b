"""The sensors' noise in the regressors, and the bias that it would leave in plain least squares.

Noise on a regressor adds its energy to the Gram matrix and so pulls the estimate towards zero (errors in variables).
With the noise's spectral density known, its expected contribution is subtracted from the normal equations (bias-
compensated least squares: Soderstrom, "Errors-in-variables methods in system identification", Automatica 43, 2007, sec.
5). The density is the aircraft file's variance times the sampling interval, and never more than the residuals allow:
noise of that size must show in them too.

To first order: noise n on the angle of attack adds k n to its regressor, -drag n to lift and lift n to drag; noise on
sideslip adds k n to its regressor; noise on a rate adds to its regressor (and to the moment a quarter period apart:
nothing). Noise on airspeed scales a signal and the k that carries its mean alike, and leaves with the mean.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout
from sysid_node.online.regression import least_squares
from sysid_node.online.regression.least_squares import Solution
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]
_LIFT, _DRAG = COEFFICIENTS.index("CL"), COEFFICIENTS.index("CD")
LARGEST_RATIO = 1.5  # a residual's density is itself uncertain: only beyond this does it contradict the aircraft file


def gram_bias(aircraft: Aircraft, layout: SignalLayout, mean: Array, step: float, air_interval: float) -> Array:
    """(W, W) expected Gram matrix of the noise, per line and second.

    ``mean`` (W,) signals' means, ``step`` and ``air_interval`` (s) the sampling intervals of IMU and air data.
    """
    noise, g = aircraft.noise, aircraft.geometry
    k = float(mean[OFFSET])
    lift, drag = float(mean[_LIFT]), float(mean[_DRAG])
    per_rate = k / (2.0 * aircraft.reference.airspeed * math.sqrt(max(k, 1e-6)))
    sources = [
        (noise["alpha"] ** 2 * air_interval, {"alpha": k, "CL": -drag, "CD": lift}),
        (noise["beta"] ** 2 * air_interval, {"beta": k}),
        *(
            (noise["gyro"] ** 2 * step, {rate: per_rate * length})
            for rate, length in zip("pqr", (g.b, g.cbar, g.b), strict=True)
        ),
    ]
    bias = np.zeros((layout.width, layout.width))
    for density, gains in sources:
        present = [(layout.column(name), gain) for name, gain in gains.items() if name in layout.names]
        for row, left in present:
            for column, right in present:
                bias[row, column] += density * left * right
    return bias


def allowed(equations: NormalEquations, solution: Solution, density: Array, bias: Array) -> Array:
    """(W,) factors on the columns, at most one: as much of the noise as the residuals' ``density`` (C,) allows.

    ``bias`` (W, W) is per line and second. The residual of a coefficient holds v' bias v of the noise, v = (1, -theta);
    where that is more than the whole residual, the file's noise is too large, and the excess is not subtracted.
    """
    v = least_squares.residual_combinations(equations, solution.theta)
    noise = ((bias @ v) * v).sum(axis=0)
    share = np.ones(equations.width)
    for c in np.flatnonzero(noise > LARGEST_RATIO * density).tolist():
        members = np.flatnonzero(v[:, c])
        share[members] = np.minimum(share[members], density[c] / noise[c])
    return np.sqrt(share)


def noise_score(equations: NormalEquations, solution: Solution, bias: Array) -> Array:
    """(P, C) what the noise alone makes of Z'r, Z the instruments and r the residuals, of its ``bias`` (W, W)."""
    left = (bias @ least_squares.residual_combinations(equations, solution.theta)).take(equations.instruments, axis=0)
    return np.asarray(left * equations.structure.belongs)
