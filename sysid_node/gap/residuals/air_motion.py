"""Motion of the air across the flight path, and the time constant of the observer that follows it.

What the inertial instruments do not explain of the air data is either motion of the air or an error of the instruments:
a late IMU leaves as much as light turbulence does. So the parameters of the instruments are first put where they leave
least.
"""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.parameter_priors import prior
from sysid_node.gap.residuals.predictions import CHANNELS, kinematic_parameters
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim.prediction.coefficients import COEFFICIENTS

#: Shortest and longest memory of the observer of the air, s.
_SHORTEST_MEMORY, LONGEST_MEMORY = 0.15, 4.0

#: Band in which gusts are separated from noise, Hz.
_GUST_BAND = (0.3, 2.0)

#: Gauss-Newton steps of the instruments' parameters.
_STEPS = 2

_FORCES = len(COEFFICIENTS)


def with_longest_memory(model: ResidualModel) -> ResidualModel:
    """The residual model with the longest memory of the observer, which leaves gusts in the readings' residual."""
    memory = model.inputs.memory._replace(observer=jnp.asarray(LONGEST_MEMORY))
    return replace(model, inputs=model.inputs._replace(memory=memory))


def gust_speed(model: ResidualModel, theta: Array) -> float:
    """Root-mean-square velocity of the air across the flight path, m/s, at parameters (P,).

    It is that of the flow angles that no motion of the aircraft explains; the median of the windows, so that the
    observer's start does not count. Without vanes it is that along the flight path, by the airspeed, because the
    turbulence is isotropic.
    """
    slow, airspeed = with_longest_memory(model), CHANNELS.index("V")
    vanes = airspeed + 1 + np.flatnonzero(model.axes[airspeed + 1 : airspeed + 3])
    if vanes.size:
        return float(model.record["V"].mean() * np.sqrt(_beyond_noise(slow, theta, vanes).mean()))
    if model.axes[airspeed]:
        return float(np.sqrt(_beyond_noise(slow, theta, np.array([airspeed])).mean()))
    return 0.0


def is_gusty(model: ResidualModel) -> bool:
    """Whether the air moves across the flight path by a share of the airspeed that counts."""
    return bool(model.gusts >= THRESHOLDS.priors.gusty * model.record["V"].mean())


def _beyond_noise(slow: ResidualModel, theta: Array, channels: NDArray[np.intp]) -> Array:
    """Mean square (K,) of these channels' residual beyond the sensors' noise."""
    power = (np.abs(slow.residual(theta)[:, 1:, channels]) ** 2).sum(axis=1)
    beyond = np.maximum(np.median(power, axis=0) - slow.noise[1:, channels].sum(axis=0), 0.0)
    return np.asarray(2.0 / slow.windows.size * beyond)


def best_instrument_parameters(model: ResidualModel) -> Array:
    """Parameters (P,) at which the air seems to move least, all but the instruments' neutral.

    They are the neutral ones or those after a few Gauss-Newton steps. In moving air the steps do not lead to a much
    calmer air.
    """
    slow, theta = with_longest_memory(model), model.simulator.neutral()
    found = [theta]
    if slow.axes[_FORCES:].any():
        for _ in range(_STEPS):
            theta = _stepped(slow, theta)
            found.append(theta)
    return min(found, key=lambda tried: gust_speed(model, tried))


def _stepped(slow: ResidualModel, theta: Array) -> Array:
    """Parameters (P,) after one Gauss-Newton step of all kinematic ones; only differences of clocks are observable."""
    simulator = slow.simulator
    fitted = [i for i in kinematic_parameters(simulator.layout) if simulator.parameters[i][1].switch]
    shown = _FORCES + np.flatnonzero(slow.axes[_FORCES:])
    residual = slow.residual(theta)[:, 1:, shown]
    slopes = slow.slopes_of_readings(theta, fitted)[:, 1:, shown - _FORCES]
    spread = np.sqrt(np.median(np.abs(residual) ** 2, axis=0) + slow.noise[1:, shown])
    rows, columns = (residual / spread).ravel(), (slopes / spread[..., None]).reshape(-1, len(fitted))
    centre, sigma = prior(simulator, fitted)
    matrix = np.vstack([columns.real, columns.imag, np.diag(1.0 / sigma)])
    right = np.concatenate([rows.real, rows.imag, (centre - theta[fitted]) / sigma])
    point = theta.copy()
    low, high = np.array([(p.lower, p.upper) for _, p in (simulator.parameters[i] for i in fitted)]).T
    point[fitted] = np.clip(theta[fitted] + np.linalg.lstsq(matrix, right, rcond=None)[0], low, high)
    return point


def observer_memory(model: ResidualModel, theta: Array) -> float:
    """The observer's best time constant, s, from the innovations of one with the longest memory at parameters (P,).

    Gusts are a random walk (their power falls with the square of frequency) and readings are noisy: the Kalman filter
    of a random walk of intensity q in white noise of density r forgets within sqrt(r / q).
    """
    slow = with_longest_memory(model)
    lines = slow.windows.frequencies
    band = (lines > _GUST_BAND[0]) & (lines < _GUST_BAND[1])
    air = _FORCES + np.flatnonzero(slow.axes[_FORCES:][:3])
    if not air.size:
        return LONGEST_MEMORY
    power = (np.abs(slow.residual(theta)) ** 2).mean(axis=0)[np.ix_(band, air)]
    noise = slow.noise[np.ix_(band, air)]
    wandering = np.maximum(power - noise, 0.0) * (2.0 * np.pi * lines[band, None]) ** 2
    memory = np.sqrt(noise.mean(axis=0) / np.maximum(wandering.mean(axis=0), 1e-300))
    return float(np.clip(np.exp(np.log(memory).mean()), _SHORTEST_MEMORY, LONGEST_MEMORY))
