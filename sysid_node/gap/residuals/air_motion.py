"""How the air moves across the flight path, and how long an observer of it should remember.

What the inertial instruments do not account for in the air data is the air's motion, or an error of the instruments: a
late IMU leaves as much as light turbulence does. So the instruments are first put where they leave least.
"""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.parameter_priors import prior
from sysid_node.gap.residuals.residual_model import (
    CHANNELS,
    COEFFICIENTS,
    LONGEST_MEMORY,
    ResidualModel,
    kinematic_parameters,
)
from sysid_node.gap.thresholds import THRESHOLDS

#: Shortest memory of the observer of the air, s.
_SHORTEST = 0.15

#: Band in which gusts are told from noise, Hz.
_GUSTS = (0.3, 2.0)

#: Gauss-Newton steps of the instruments.
_STEPS = 2

_FORCES = len(COEFFICIENTS)


def with_longest_memory(model: ResidualModel) -> ResidualModel:
    """The view with a long memory of the air: gusts are left in its readings."""
    memory = model.given.memory._replace(observer=jnp.asarray(LONGEST_MEMORY))
    return replace(model, given=model.given._replace(memory=memory))


def gust_speed(model: ResidualModel, theta: Array) -> float:
    """Root-mean-square motion of the air across the flight path (m/s): flow angles that no motion accounts for.

    At parameters (P,); the median of the windows, which the observer's start leaves out. Where no vane was there, by
    the airspeed alone: air that moves moves alike in all directions.
    """
    calm, airspeed = with_longest_memory(model), CHANNELS.index("V")
    vanes = airspeed + 1 + np.flatnonzero(model.axes[airspeed + 1 : airspeed + 3])
    if vanes.size:
        return float(model.record["V"].mean() * np.sqrt(_beyond_noise(calm, theta, vanes).mean()))
    if model.axes[airspeed]:
        return float(np.sqrt(_beyond_noise(calm, theta, np.array([airspeed])).mean()))
    return 0.0


def is_gusty(model: ResidualModel) -> bool:
    """Whether the air moves across the flight path by enough to count."""
    return bool(model.gusts >= THRESHOLDS.priors.gusty * model.record["V"].mean())


def _beyond_noise(calm: ResidualModel, theta: Array, channels: NDArray[np.intp]) -> Array:
    """Mean square (K,) of some channels' residual that is more than the sensors' noise."""
    power = (np.abs(calm.residual(theta)[:, 1:, channels]) ** 2).sum(axis=1)
    beyond = np.maximum(np.median(power, axis=0) - calm.noise[1:, channels].sum(axis=0), 0.0)
    return np.asarray(2.0 / calm.windows.size * beyond)


def best_instrument_parameters(model: ResidualModel) -> Array:
    """Parameters (P,) with the instruments' own where the air seems to move least: neutral, or a few steps from there.

    In air that moves the steps lead anywhere, and do not make it seem much calmer.
    """
    calm, theta = with_longest_memory(model), model.simulator.neutral()
    found = [theta]
    if calm.axes[_FORCES:].any():
        for _ in range(_STEPS):
            theta = _stepped(calm, theta)
            found.append(theta)
    return min(found, key=lambda there: gust_speed(model, there))


def _stepped(calm: ResidualModel, theta: Array) -> Array:
    """One step of least squares of all that kinematics depend on; of clocks, they know differences only."""
    simulator = calm.simulator
    own = [i for i in kinematic_parameters(simulator.layout) if simulator.parameters[i][1].switch]
    shown = _FORCES + np.flatnonzero(calm.axes[_FORCES:])
    residual, slopes = calm.residual(theta)[:, 1:, shown], calm.slopes_of_readings(theta, own)[:, 1:, shown - _FORCES]
    spread = np.sqrt(np.median(np.abs(residual) ** 2, axis=0) + calm.noise[1:, shown])
    rows, columns = (residual / spread).ravel(), (slopes / spread[..., None]).reshape(-1, len(own))
    centre, sigma = prior(simulator, own)
    matrix = np.vstack([columns.real, columns.imag, np.diag(1.0 / sigma)])
    right = np.concatenate([rows.real, rows.imag, (centre - theta[own]) / sigma])
    there = theta.copy()
    low, high = np.array([(p.lower, p.upper) for _, p in (simulator.parameters[i] for i in own)]).T
    there[own] = np.clip(theta[own] + np.linalg.lstsq(matrix, right, rcond=None)[0], low, high)
    return there


def observer_memory(model: ResidualModel, theta: Array) -> float:
    """The observer's best memory of the air (s), from innovations of a long one at parameters (P,).

    Gusts wander (their power falls with the square of frequency), readings are noisy: the Kalman filter of a random
    walk of intensity q in white noise of density r forgets within sqrt(r / q).
    """
    calm = with_longest_memory(model)
    lines = calm.windows.frequencies
    band = (lines > _GUSTS[0]) & (lines < _GUSTS[1])
    air = _FORCES + np.flatnonzero(calm.axes[_FORCES:][:3])
    if not air.size:
        return LONGEST_MEMORY
    power = (np.abs(calm.residual(theta)) ** 2).mean(axis=0)[np.ix_(band, air)]
    noise = calm.noise[np.ix_(band, air)]
    wandering = np.maximum(power - noise, 0.0) * (2.0 * np.pi * lines[band, None]) ** 2
    memory = np.sqrt(noise.mean(axis=0) / np.maximum(wandering.mean(axis=0), 1e-300))
    return float(np.clip(np.exp(np.log(memory).mean()), _SHORTEST, LONGEST_MEMORY))
