"""How late a control follows what is recorded of it: a response with two parameters, in the frequency domain.

    h(s) = 1 / (1 + L s + B s^2)

with the lateness L (s) and the curvature B (s^2). B = 0 is a servo of first order with the time constant L; a servo of
second order with natural frequency w and damping d has L = 2 d / w and B = 1 / w^2; a pure delay is this response with
B = L^2 / 2 up to the third order in L s (its Pade approximation); and a servo with a delay has the sum of both L. In
the band of the lines, a few rad/s, more than two parameters cannot be told apart.

What the alignment has applied already to the recorded commands (the file's servo, with the parameters L0 and B0) is
taken out: the response is (1 + L0 s + B0 s^2) h(s). It is written as 1 + j omega g(omega), so that it acts on the exact
transform of the control's rate, whose boundary terms are right: X = X + g (transform of the rate).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.servos import Servo

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LATEST = 0.5  # s: no servo of an aircraft that flies is later


@dataclass(frozen=True)
class ServoModel:
    """Lateness (s) and curvature (s^2) of each of m controls' servos."""

    lateness: Array  # (m,)
    curvature: Array  # (m,)

    def moved(self, by_lateness: Array, by_curvature: Array) -> ServoModel:
        """Another such model, kept within what is possible: a response that has no resonance in the band."""
        lateness = np.clip(self.lateness + by_lateness, -0.1, LATEST)
        least = -0.25 * np.maximum(lateness, 0.02) ** 2
        return ServoModel(lateness, np.clip(self.curvature + by_curvature, least, np.maximum(lateness, 0.02) ** 2))


def of_servo(servo: Servo) -> tuple[float, float]:
    """Lateness (s) and curvature (s^2) of a servo of the aircraft file, its rate limit left out."""
    T, d = servo.time_constant, servo.delay
    late, curved = (2.0 * servo.damping * T, T * T) if servo.damping else (T, 0.0)
    return late + d, curved + late * d + 0.5 * d * d


def lateness(model: ServoModel, applied: ServoModel, omega: Array) -> Complex:
    """(F, m) g of the controls: what their rates' lines at ``omega`` (F,) rad/s bring to their own."""
    s = 1j * omega[:, None]
    more = (applied.lateness - model.lateness) + s * (applied.curvature - model.curvature)
    return np.asarray(more / _denominator(model, s))


def rate_gain(model: ServoModel, omega: Array) -> Complex:
    """(F, m) what a corrected rate's lines bring to the control's lines, per second of lateness.

    That is d h / dL over s h = -1 / (1 + L s + B s^2). Per s^2 of curvature it is this times s.
    """
    return np.asarray(-1.0 / _denominator(model, 1j * omega[:, None]))


def _denominator(model: ServoModel, s: NDArray[Any]) -> Complex:
    return np.asarray(1.0 + model.lateness * s + model.curvature * s * s)
