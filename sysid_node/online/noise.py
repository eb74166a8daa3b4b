"""The sensors' noise in the regressors, and the bias that it would leave in plain least squares.

Noise on a regressor adds its energy to the Gram matrix and so pulls the estimate towards zero (errors in variables).
With the noise's spectral density known, its expected contribution is subtracted from the normal equations
(bias-compensated least squares: Soderstrom, "Errors-in-variables methods in system identification", Automatica 43,
2007, sec. 5). The density is the aircraft file's variance times the sampling interval, and never more than the residuals allow:
noise of that size must show in them too.

To first order: noise n on the angle of attack adds k n to its regressor, -drag n to lift and lift n to drag; noise
on sideslip adds k n to its regressor; noise on a rate adds to its regressor (and, a quarter period apart, to the moment: nothing).
Noise on airspeed scales a signal and the k that carries its mean alike, and leaves with the mean.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.regression import Plan, Solution
from sysid_node.online.signals import Layout

Array = NDArray[np.float64]
DOUBT = 1.5  # a residual's density is itself uncertain: only beyond this does it contradict the aircraft file


def gram_bias(aircraft: Aircraft, layout: Layout, mean: Array, step: float, air_interval: float) -> Array:
    """(W, W) expected Gram matrix of the noise, per line and second.

    ``mean`` (W,) signals' means, ``step`` and ``air_interval`` (s) the sampling intervals of IMU and air data.
    """
    noise, names = aircraft.noise, layout.names
    k = float(mean[layout.column("0")])
    speed = aircraft.reference.airspeed * math.sqrt(max(k, 1e-6))
    bias = np.zeros((layout.width, layout.width))

    def add(density: float, gains: dict[str, float]) -> None:
        j = np.array([gains.get(name, 0.0) for name in names])
        bias[:] += density * np.outer(j, j)

    lift, drag = float(mean[layout.column("CL")]), float(mean[layout.column("CD")])
    add(noise["alpha"] ** 2 * air_interval, {"alpha": k, "CL": -drag, "CD": lift})
    add(noise["beta"] ** 2 * air_interval, {"beta": k})
    g = aircraft.geometry
    for rate, length in (("p", g.b), ("q", g.cbar), ("r", g.b)):
        add(noise["gyro"] ** 2 * step, {rate: k * length / (2.0 * speed)})
    return bias


def capped(plan: Plan, solution: Solution, density: Array, bias: Array, line_seconds: float) -> Array:
    """(W, W) ``bias`` scaled down, column by column, to what the residuals' ``density`` (C,) allows.

    ``bias`` holds the noise's expected contribution over ``line_seconds`` (lines times seconds). The residual of a
    coefficient holds v' bias v of the noise, v = (1, -theta); where that is more than the whole residual, the aircraft
    file's noise is too large, and the excess is not subtracted.
    """
    share = np.ones(bias.shape[0])
    for c in range(plan.outputs.size):
        mine = plan.unknowns(c)
        members = np.append(plan.columns[mine], plan.outputs[c])
        v = np.append(-solution.theta[mine, c], 1.0)
        noise = float(v @ bias[np.ix_(members, members)] @ v) / line_seconds
        if noise > DOUBT * density[c]:
            share[members] = np.minimum(share[members], density[c] / noise)
    root = np.sqrt(share)
    return bias * root[:, None] * root
