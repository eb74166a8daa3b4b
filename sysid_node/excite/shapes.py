"""Shapes of inputs: functions of time with a peak of one, zero outside ``0 <= time <= length``.

Sources: multistep inputs after Koehler & Wilhelm (1977; the 3-2-1-1) and Plaetschke & Schulz (1979); exponential sweep
after Tischler & Remple, "Aircraft and Rotorcraft System Identification", 2nd ed. (2012), eq. 5.15-5.17.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.excite.multisine import harmonics, sum_of_sines, to_zero_crossing

Array = NDArray[np.float64]

#: A sample this close to a switching time (s) belongs to the next step: times such as 0.3 are not exact in binary.
_EDGE = 1e-9


def inside(time: Array, length: float) -> NDArray[np.bool_]:
    """Whether each time (N,) is within the shape."""
    return (time >= -_EDGE) & (time <= length + _EDGE)


def multistep(time: Array, pattern: Sequence[float], width: float) -> Array:
    """Steps of +1, -1, +1, ... lasting ``pattern`` times ``width`` (s): (3, 2, 1, 1) is the 3-2-1-1."""
    edges = width * np.concatenate([[0.0], np.cumsum(pattern)])
    step = np.searchsorted(edges, time + _EDGE, side="right") - 1
    on = (step >= 0) & (step < len(pattern))
    return np.where(on, np.where(step % 2 == 0, 1.0, -1.0), 0.0)


def ramp(time: Array, length: float) -> Array:
    """A triangle: from 0 to 1 in a quarter of ``length`` (s), to -1 in the next half, and back; slow, quasi-static."""
    return np.interp(time, [0.0, 0.25 * length, 0.75 * length, length], [0.0, 1.0, -1.0, 0.0], left=0.0, right=0.0)


def sweep(time: Array, length: float, low: float, high: float) -> Array:
    """A sine whose frequency grows exponentially from ``low`` to ``high`` (Hz), faded over 5 % at both ends."""
    C1 = 4.0
    C2 = 1.0 / np.expm1(C1)
    t = np.clip(time, 0.0, length)
    # the integral of K = C2 (exp(C1 t / T) - 1)
    K_integral = C2 * (length / C1 * np.expm1(C1 * t / length) - t)
    wave = np.sin(2 * np.pi * (low * t + (high - low) * K_integral))
    fade = np.clip(np.minimum(t, length - t) / (0.05 * length), 0.0, 1.0)
    return np.asarray(np.where(inside(time, length), wave * np.sin(0.5 * np.pi * fade) ** 2, 0.0))


def random(time: Array, length: float, low: float, high: float, seed: int) -> Array:
    """Gaussian noise, flat between ``low`` and ``high`` (Hz) and nothing outside; begins and ends at zero.

    Every harmonic of 1/length in the band has an amplitude and a phase drawn at random: what remains of white noise
    over one period. Raises InputError where no harmonic lies in the band.
    """
    numbers = harmonics(length, low, high)
    generator = np.random.default_rng(seed)
    amplitude = generator.rayleigh(size=numbers.size)
    phase = to_zero_crossing(numbers, amplitude, generator.uniform(0, 2 * np.pi, numbers.size))
    wave, peak = sum_of_sines(time / length, numbers, amplitude, phase)
    return np.where(inside(time, length), wave / peak, 0.0)
