"""Whether an effect moves the response by enough to matter: measured in the plant, which can fly without it too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.signal import butter, sosfiltfilt

from bench.withheld.plants.instruments import Log
from bench.withheld.plants.motion import Effects
from sysid_node.aircraft.model import Aircraft

Array = NDArray[np.float64]

#: Band that is compared, Hz.
_BAND = 4.0

#: Tolerances of the file that is handed over by which a derivative may be off.
_WIDEST = 3.0

_READ = slice(0, 6), slice(9, 12)  # of the readings: IMU and air data, without the attitude
_DELAYS = {"imu_delay": slice(0, 9), "air_data_delay": slice(9, 12)}


def stamped(log: Log, seen: Array, effects: Effects) -> Array:
    """Readings (N, 12) as their stamps have them."""
    late = seen.copy()
    for name, columns in _DELAYS.items():
        delay = effects.get(name, {}).get("delay", 0.0)
        late[:, columns] = np.column_stack([np.interp(log.time - delay, log.time, c) for c in seen[:, columns].T])
    return late


def moved(with_it: Array, without: Array, aircraft: Aircraft) -> float:
    """How far the readings (N, 12) of two flights lie apart, rms, over the sensors' noise: the largest of all."""
    sigma = _sigma(aircraft)
    apart = np.sqrt(np.mean((with_it - without) ** 2, axis=0))
    return float(max((apart / sigma)[part].max() for part in _READ))


def _sigma(aircraft: Aircraft) -> Array:
    spreads = [aircraft.noise[n] for n in ("accel", "gyro", "attitude", "airspeed", "alpha", "beta")]
    return np.repeat(spreads, [3, 3, 3, 1, 1, 1])


def beyond(with_it: Array, without: Array, noise: Array) -> float:
    """By how much an effect exceeds what tolerances excuse.

    What is left (N, 6) of a flight with it over what is left without it and of the noise, on the axis with most.
    """
    size, floor = (np.mean(x**2, axis=0) for x in (with_it, without))
    return float(np.sqrt(size / (floor + np.mean(noise**2, axis=0))).max())


def inexplicable(log: Log, seen: Array, aircraft: Aircraft, effects: Effects, rate: float) -> Array:
    """What is left (N, 6), below 4 Hz, of the readings made coefficients as the aircraft file would make them, when its
    derivatives have done their best within three tolerances."""
    late = effects.get("actuator_stamp_delay", {}).get("delay", 0.0)
    commands = np.column_stack([np.interp(log.time - late, log.time, c) for c in log.commands.T])
    found, x = coefficients(aircraft, seen, commands, log.density, rate)
    low = butter(4, _BAND, fs=rate, output="sos")
    left = np.empty_like(found)
    for i, coefficient in enumerate(("CL", "CD", "CY", "Cl", "Cm", "Cn")):
        own = [(r, d) for n, d in aircraft.derivatives.items() for c, _, r in [n.partition("_")] if c == coefficient]
        matrix = np.column_stack([x[r] for r, _ in own])
        off = sosfiltfilt(low, found[:, i] - matrix @ [d.value for _, d in own])
        left[:, i] = within_tolerances(off, sosfiltfilt(low, matrix, axis=0), [d.tolerance or 1.0 for _, d in own])
    return left


def within_tolerances(off: Array, columns: Array, tolerances: Sequence[float]) -> Array:
    """What is left of residuals (N,) when derivatives (regressors: (N, D)) do their best within three tolerances."""
    steps = columns * tolerances
    return np.asarray(off - steps @ lsq_linear(steps, off, (-_WIDEST, _WIDEST)).x)


def noisy(seen: Array, aircraft: Aircraft, rate: float, random: np.random.Generator) -> Array:
    """Readings with the sensors' noise, as strong in the band as that of samples at 200 Hz."""
    return np.asarray(seen + _sigma(aircraft) * random.standard_normal(seen.shape) * np.sqrt(rate / 200.0))


def coefficients(
    aircraft: Aircraft, seen: Array, commands: Array, density: Array, rate: float
) -> tuple[Array, dict[str, Array]]:
    """CL, CD, CY, Cl, Cm, Cn (N, 6) of readings and thrust by the aircraft file, and the regressors."""
    geometry, inertia = aircraft.geometry, aircraft.inertia
    low = butter(4, min(12.0, 0.4 * rate), fs=rate, output="sos")
    rates, thrust = seen[:, 3:6], commands[:, -1]
    turning = np.gradient(sosfiltfilt(low, rates, axis=0), 1.0 / rate, axis=0)
    arm = np.array(aircraft.sensors.imu)
    force = aircraft.mass * (seen[:, :3] - np.cross(turning, arm) - np.cross(rates, np.cross(rates, arm)))
    V, alpha, beta = _at_cg(aircraft, seen)
    scale = 0.5 * density * V**2 * geometry.S
    throttle = aircraft.throttle
    fx = force[:, 0] - (thrust * np.cos(throttle.inclination) if throttle else 0.0)
    fz = force[:, 2] + (thrust * np.sin(throttle.inclination) if throttle else 0.0)
    sin, cos = np.sin(alpha), np.cos(alpha)
    p, q, r = rates.T
    matrix = np.array([[inertia.Ixx, 0.0, -inertia.Ixz], [0.0, inertia.Iyy, 0.0], [-inertia.Ixz, 0.0, inertia.Izz]])
    moment = turning @ matrix.T + np.cross(rates, rates @ matrix.T)
    moment[:, 1] -= thrust * throttle.arm if throttle else 0.0
    lengths = np.array([geometry.b, geometry.cbar, geometry.b])
    found = np.column_stack(
        [
            (fx * sin - fz * cos) / scale,
            -(fx * cos + fz * sin) / scale,
            force[:, 1] / scale,
            *(moment / (scale[:, None] * lengths)).T,
        ]
    )
    half = 0.5 / V
    x = {"0": np.ones(len(V)), "alpha": alpha, "beta": beta, "p": p * geometry.b * half}
    x |= {"q": q * geometry.cbar * half, "r": r * geometry.b * half}
    return found, x | dict(zip(aircraft.control_symbols, commands[:, :-1].T, strict=True))


def _at_cg(aircraft: Aircraft, seen: Array) -> tuple[Array, Array, Array]:
    V, alpha, beta = seen[:, 9:].T
    u, w = V * np.cos(beta) * np.cos(alpha), V * np.cos(beta) * np.sin(alpha)
    flow = np.column_stack([u, V * np.sin(beta), w]) - np.cross(seen[:, 3:6], np.array(aircraft.sensors.air_data))
    forward = np.hypot(flow[:, 0], flow[:, 2])
    return np.hypot(forward, flow[:, 1]), np.arctan2(flow[:, 2], flow[:, 0]), np.arctan2(flow[:, 1], forward)
