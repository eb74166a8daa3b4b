"""Allowance in the standard errors for a correlation between deflections and gusts.

Instruments made from the deflections are uncorrelated with gusts only if nobody answers gusts with the surfaces.
Pilots and autopilots do. The resulting bias cannot be estimated from the flight, but it can be allowed for: a
correlation of ``ALLOWED`` between instruments and gusts shifts an estimate by that share of the square root of the
degrees of freedom in standard errors (Conley, Hansen & Rossi, "Plausibly exogenous", Review of Economics and Statistics
94, 2012). Intervals therefore stop shrinking with more data at that bound. The sensors' noise hardly moves a
surface, so only the part of a residual beyond the sensors' noise counts as gusts.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.regression.heteroskedasticity import DOUBT, NoiseMoments
from sysid_node.online.regression.least_squares import Solution, Uncertainty, misfits
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]

ALLOWED = 0.05  # correlation between instruments and gusts


def share_of_gusts(spread: Uncertainty, sensed: Array) -> Array:
    """(C,) share of each residual that is not the sensors' noise, of which ``sensed`` (C,) is the density."""
    return np.asarray(np.clip(1.0 - DOUBT * sensed / np.maximum(spread.density, 1e-300), 0.0, 1.0))


def inflation(spread: Uncertainty, gusts: Array) -> Array:
    """(C,) factors of the covariance; ``gusts`` (C,): see ``share_of_gusts``."""
    return np.asarray(1.0 + ALLOWED**2 * spread.freedom * gusts)


def sensed(
    aircraft: Aircraft,
    equations: NormalEquations,
    solution: Solution,
    bias: Array,
    noise_moments: NoiseMoments,
    step: float,
    omega: Array,
) -> Array:
    """(C,) density of the sensors' noise in the residuals.

    ``bias`` (W, W): noise of the regressors, per line and second (``regressor_noise.gram_bias``); ``step`` (s): IMU
    interval; ``omega`` (F,) rad/s: the lines, over which a rate's derivative has the noise of the rate times omega.
    """
    v = misfits(equations, solution.theta)
    density: Array = ((bias @ v) * v).sum(axis=0)
    if noise_moments.duration > 0.0:
        density = density + (noise_moments.power + noise_moments.alpha_power) / noise_moments.duration
    reference, g, i = aircraft.reference, aircraft.geometry, aircraft.inertia
    qS = 0.5 * reference.air_density * reference.airspeed**2 * g.S
    force = aircraft.noise["accel"] * aircraft.mass / qS
    turning = aircraft.noise["gyro"] * math.sqrt(float(np.mean(omega**2))) / qS
    gains = {"CL": force, "CD": force, "CY": force}
    gains |= {"Cl": turning * i.Ixx / g.b, "Cm": turning * i.Iyy / g.cbar, "Cn": turning * i.Izz / g.b}
    return density + step * np.array([gains[c] for c in equations.structure.coefficients]) ** 2
