"""How late a control follows what is recorded of it: its response in the frequency domain.

    h(s) = 1 / (1 + L s + B s^2 + C s^3)

with the lateness L (s), the curvature B (s^2) and C (s^3). B = C = 0 is a servo of first order with the time constant
L; one of second order with natural frequency w and damping d has L = 2 d / w, B = 1 / w^2 and C = 0; a delay has
B = L^2 / 2 and C = L^3 / 6; and a servo with a delay has the product of both. In the band of the lines, a few rad/s,
flights tell L and B apart. What they change of C follows from both, ``CUBIC`` B^2 / L, within a tolerance.

What the alignment has applied already to the recorded commands (the file's servo, with L0, B0 and C0) is taken out:
the response is (1 + L0 s + B0 s^2 + C0 s^3) h(s). It is written as 1 + j omega g(omega), so that it acts on the exact
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

#: C L over B^2 of what is not known of a servo: 0 for lags of first and second order without a delay, 2/3 for a delay,
#: 0.56 for a lag of first order with a delay of a third of the lateness, 0.47 for one of second order (damping 0.7).
CUBIC = 0.4
SHORTEST = 0.02  # s: the lateness from which on C, and the tolerances of B and C, go with it
LATEST = 0.5  # s: no servo of an aircraft that flies is later


@dataclass(frozen=True)
class ServoModel:
    """Lateness (s) and curvature (s^2) of each of m controls' servos."""

    lateness: Array  # (m,)
    curvature: Array  # (m,)
    third: Array  # (m,) s^3

    def moved(self, by_lateness: Array, by_curvature: Array) -> ServoModel:
        """Another such model, kept within what is possible: a response that has no resonance in the band."""
        lateness = np.clip(self.lateness + by_lateness, -0.1, LATEST)
        most = np.maximum(lateness, SHORTEST) ** 2
        curvature = np.clip(self.curvature + by_curvature, -0.25 * most, most)
        third = self.third + expected_third(lateness, curvature) - expected_third(self.lateness, self.curvature)
        return ServoModel(lateness, curvature, third)


def expected_third(lateness: Array, curvature: Array) -> Array:
    """(m,) C (s^3) that is expected of servos of which L (s) and B (s^2) alone are known."""
    return np.asarray(CUBIC * curvature**2 / np.maximum(lateness, SHORTEST))


def third_slopes(lateness: Array, curvature: Array) -> tuple[Array, Array]:
    """(m,) slopes of ``expected_third`` by the lateness (s^2) and by the curvature (s)."""
    ratio = curvature / np.maximum(lateness, SHORTEST)
    return np.where(lateness > SHORTEST, -CUBIC * ratio**2, 0.0), 2.0 * CUBIC * ratio


def of_servo(servo: Servo) -> tuple[float, float, float]:
    """Lateness (s), curvature (s^2) and third coefficient (s^3) of a servo of the aircraft file, without rate limit."""
    T, d = servo.time_constant, servo.delay
    late, curved = (2.0 * servo.damping * T, T * T) if servo.damping else (T, 0.0)
    third = curved * d + 0.5 * late * d * d + d**3 / 6.0
    return late + d, curved + late * d + 0.5 * d * d, third


def lateness(model: ServoModel, applied: ServoModel, omega: Array) -> Complex:
    """(F, m) g of the controls: what their rates' lines at ``omega`` (F,) rad/s bring to their own."""
    s = 1j * omega[:, None]
    more = (applied.lateness - model.lateness) + s * (applied.curvature - model.curvature)
    more = more + s * s * (applied.third - model.third)
    return np.asarray(more / _denominator(model, s))


def rate_gain(model: ServoModel, omega: Array) -> Complex:
    """(F, 2m) what a corrected rate's lines bring to the control's lines, per second of lateness.

    That is d h / dL over s h = -h(s). Per s^2 of curvature it is this times s, and per s^3 of the third coefficient
    this times s^2, which stands behind the first m.
    """
    gain = -1.0 / _denominator(model, 1j * omega[:, None])
    return np.concatenate([gain, -(omega[:, None] ** 2) * gain], axis=1)


def _denominator(model: ServoModel, s: NDArray[Any]) -> Complex:
    return np.asarray(1.0 + s * (model.lateness + s * (model.curvature + s * model.third)))
