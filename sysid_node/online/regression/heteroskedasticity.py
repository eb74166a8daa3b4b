"""Heteroskedastic sensor noise: its variance follows the motion.

Noise in the airspeed multiplies a coefficient's motion, and an error of the angle of attack turns lift into drag. Such
noise is large while the regressors move, so that a stationary density of the same energy underestimates its effect.
With the noise's density w(t) the estimates' covariance holds the integral of w x x' where stationary noise has that of
x x' times the mean of w (the heteroskedastic sandwich of White, Econometrica 48, 1980). The two integrals are collected
in the time domain; how many of the lines' products they stand for is told by those of stationary noise.

The drag's part by the angle of attack is kept apart: what is left of the drag beyond the sensors' noise is an error of
that angle, too, as where the air turns and the probe is not at the centre of gravity.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]
EXCESS_RATIO = 1.5  # times the sensors' noise that a residual holds before it is more than that
RIDGE, TINY = 1e-9, 1e-100  # set regressors apart that moved alike, or not at all


@dataclass
class NoiseMoments:
    """Integrals over time, of C coefficients and P unknowns."""

    weighted: Array | float = 0.0  # (C, P, P) of w x x'
    power: Array | float = 0.0  # (C,) of w
    moments: Array | float = 0.0  # (P, P) of x x'
    alpha_weighted: Array | float = 0.0  # (C, P, P) of w x x', where w is by the angle of attack
    alpha_power: Array | float = 0.0  # (C,) of that w
    accelerometer_power: Array | float = (
        0.0  # (C,) of the accelerometer's noise density, where it matters beside that w
    )
    duration: float = 0.0  # s

    def __add__(self, other: NoiseMoments) -> NoiseMoments:
        return NoiseMoments(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))

    def __mul__(self, factor: float) -> NoiseMoments:
        return NoiseMoments(*(getattr(self, f.name) * factor for f in fields(self)))


def measure(
    aircraft: Aircraft,
    layout: SignalLayout,
    equations: NormalEquations,
    theta: Array,
    rows: Array,
    mean: Array,
    duration: float,
    every: float,
    boxes: int,
) -> NoiseMoments:
    """Of a stretch of ``duration`` (s): signals ``rows`` (N, T) about their ``mean`` (T,).

    ``theta`` (P, C): derivatives, right in size, such as the aircraft file's. ``every`` (s): the air data's interval,
    over which their noise lasts. ``boxes``: into so many stretches, as long as the lines' band resolves, regressors are
    averaged; the noise's density is not.
    """
    structure = equations.structure
    x = rows[:, equations.columns] - mean[equations.columns]
    relative = 2.0 * aircraft.noise["airspeed"] / aircraft.reference.airspeed
    w = (relative * (x @ theta)) ** 2
    alpha_weighted, accelerometer_power = np.zeros((len(rows), theta.shape[1])), np.zeros(theta.shape[1])
    step = duration / len(rows)
    if "CD" in structure.coefficients and "alpha" in layout.names:
        c = structure.coefficients.index("CD")
        of_alpha = theta[[i for i in structure.unknowns(c).tolist() if structure.regressors[i] == "alpha"], c].sum()
        turned = rows[:, layout.column("CL")] - of_alpha * rows[:, OFFSET]
        alpha_weighted[:, c] = (aircraft.noise["alpha"] * turned) ** 2
        accelerometer_power[c] = duration * step * (aircraft.noise["accel"] * _per_acceleration(aircraft)) ** 2
    starts = np.arange(0, len(rows), -(-len(rows) // boxes))
    counts = np.diff(starts, append=len(rows))[:, None]
    slow = np.add.reduceat(x, starts) / counts
    sums = [np.add.reduceat(density, starts) * (every * step) for density in (w, alpha_weighted)]
    weighted, by_lift = ((w.T[:, :, None] * slow).swapaxes(1, 2) @ slow for w in sums)
    powers = [w.sum(axis=0) for w in sums]
    return NoiseMoments(
        weighted, powers[0], (counts * slow).T @ slow * step, by_lift, powers[1], accelerometer_power, duration
    )


def _per_acceleration(aircraft: Aircraft) -> float:
    """Coefficient of a force that accelerates the aircraft by 1 m/s^2 at the reference."""
    reference = aircraft.reference
    return aircraft.mass / (0.5 * reference.air_density * reference.airspeed**2 * aircraft.geometry.S)


def heteroskedastic_excess(
    noise_moments: NoiseMoments, even: Array, same_block: Array, density: Array
) -> Array | float:
    """(C, P, P) what heteroskedasticity adds to the scores' covariance; ``even`` (P, P) is it for noise of density 1.

    ``same`` (P, P): 1 where two unknowns belong to one block. The integrals hold more than the lines' band, so they are
    turned and scaled such that for stationary noise they would be ``even``, and no more than the residual's ``density``
    (C,) is taken to come and go.
    """
    if noise_moments.duration <= 0.0:
        return 0.0
    moments = noise_moments.moments * same_block
    other = density * noise_moments.duration - EXCESS_RATIO * (noise_moments.power + noise_moments.accelerometer_power)
    more = np.maximum(other / np.maximum(noise_moments.alpha_power, TINY), 1.0)
    weighted = noise_moments.weighted + more[:, None, None] * noise_moments.alpha_weighted
    mean = (noise_moments.power + more * noise_moments.alpha_power) / noise_moments.duration
    extra = (weighted - np.multiply.outer(mean, moments)) * same_block
    extra *= np.minimum(density / np.maximum(mean, TINY), 1.0)[:, None, None]
    turn = np.linalg.solve(_root(moments).T, _root(even).T).T
    found: Array = turn @ extra @ turn.T
    return found


def _root(moments: Array) -> Array:
    """Cholesky factor of a matrix that may be singular."""
    return np.asarray(np.linalg.cholesky(moments + np.diag(RIDGE * moments.diagonal() + TINY)))
