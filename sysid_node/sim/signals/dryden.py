"""Continuous turbulence with Dryden spectra, as time series along body axes.

Spectra, intensities and scale lengths: MIL-F-8785C (1980), sec. 3.7.1.2 (Dryden form), 3.7.2 (medium and high altitude)
and 3.7.3 (low altitude). The spectra are realised by white noise through the exact discrete form of their
shaping filters, started in the stationary state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_continuous_lyapunov

from sysid_node.errors import InputError

Array = NDArray[np.float64]

_FOOT = 0.3048
_KNOT = 0.514444

#: rms of the vertical gusts at low altitude, m/s: 0.1 of the wind at 20 ft (15, 30, 45 knots).
INTENSITIES = {"none": 0.0, "light": 1.5 * _KNOT, "moderate": 3.0 * _KNOT, "severe": 4.5 * _KNOT}


@dataclass(frozen=True)
class Dryden:
    """Rms (m/s) and scale lengths (m) along body x, y, z for vertical gusts of 1 m/s; span (m) for the rotary gusts."""

    sigma: tuple[float, float, float]
    length: tuple[float, float, float]
    span: float

    @classmethod
    def at(cls, height: float, span: float) -> Dryden:
        """Turbulence at a height above the ground (m), for a wing span (m); below 3 m (10 ft) as at 3 m."""
        feet = max(height / _FOOT, 10.0)
        if feet >= 2000.0:
            return cls((1.0, 1.0, 1.0), (1750.0 * _FOOT,) * 3, span)
        if feet > 1000.0:  # linear between the two models
            share = (feet - 1000.0) / 1000.0
            length = _FOOT * (1000.0 + 750.0 * share)
            return cls((1.0, 1.0, 1.0), (length, length, length), span)
        shear = 0.177 + 0.000823 * feet
        along = feet / shear**1.2 * _FOOT
        return cls((shear**-0.4, shear**-0.4, 1.0), (along, along, feet * _FOOT), span)

    def realisation(self, samples: int, rate: float, airspeed: float, seed: int | np.random.Generator) -> Array:
        """Gusts (N, 6): velocity of the air along body axes (m/s), its rotation (rad/s), rms 1 m/s vertically.

        ``airspeed`` m/s turns length into time (frozen turbulence). Raises InputError unless it is positive.
        """
        if not airspeed > 0.0:
            raise InputError(f"turbulence: airspeed {airspeed:g} m/s: expected more than zero")
        random = np.random.default_rng(seed)
        (su, sv, sw), (lu, lv, lw) = self.sigma, self.length
        yaw_time, pitch_time = (k * self.span / (np.pi * airspeed) for k in (3.0, 4.0))
        u = _longitudinal(su, lu / airspeed).draw(samples, rate, random)
        v = _transverse(sv, lv / airspeed, yaw_time).draw(samples, rate, random)
        w = _transverse(sw, lw / airspeed, pitch_time).draw(samples, rate, random)
        roll_rms = sw * np.sqrt(0.1 * np.pi**2 / (lw * self.span) * (np.pi * lw / (4.0 * self.span)) ** (1.0 / 3.0))
        p = _longitudinal(roll_rms, pitch_time).draw(samples, rate, random)
        # frozen turbulence, d/dt = V d/dx: the air's rotation is q = -dw/dx and r = dv/dx
        return np.column_stack([u[:, 0], v[:, 0], w[:, 0], p[:, 0], -w[:, 1] / airspeed, v[:, 1] / airspeed])


@dataclass(frozen=True)
class _Filter:
    """A stationary process: dx/dt = A x + noise of stationary covariance P, y = C x."""

    A: Array
    P: Array
    C: Array

    def draw(self, samples: int, rate: float, random: np.random.Generator) -> Array:
        """A realisation (N, outputs) at a rate (Hz): exact at the samples."""
        step = expm(self.A / rate)
        root = _root(self.P - step @ self.P @ step.T)
        noise = random.standard_normal((samples, len(self.A))) @ root.T
        x = _root(self.P) @ random.standard_normal(len(self.A))
        states = np.empty_like(noise)
        for k in range(samples):
            states[k] = x
            x = step @ x + noise[k]
        return np.asarray(states @ self.C.T)


def _longitudinal(sigma: float, time: float) -> _Filter:
    """sigma sqrt(2 T) / (1 + T s): the form of u and, with its own time, of the roll gusts."""
    return _Filter(np.array([[-1.0 / time]]), np.array([[sigma**2]]), np.array([[1.0]]))


def _transverse(sigma: float, time: float, angular_time: float) -> _Filter:
    """sigma sqrt(T) (1 + sqrt(3) T s) / (1 + T s)^2, and its derivative through 1 / (1 + angular_time s)."""
    a = 1.0 / time
    # x1, x2: the two lags in series; y is their combination with the zero; x3: y through the angular lag
    A = np.array([[-a, 0.0, 0.0], [a, -a, 0.0], [0.0, 0.0, -1.0 / angular_time]])
    y = np.array([np.sqrt(3.0), 1.0 - np.sqrt(3.0), 0.0])
    A[2] += y / angular_time
    b = np.array([[sigma * np.sqrt(a)], [0.0], [0.0]])
    P = solve_continuous_lyapunov(A, -b @ b.T)
    return _Filter(A, P, np.vstack([y, (y - [0.0, 0.0, 1.0]) / angular_time]))


def _root(covariance: Array) -> Array:
    """A square root of a covariance; negative eigenvalues, which come from rounding, count as zero."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
