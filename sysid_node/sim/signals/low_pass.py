"""The low-pass through which a flight and its prediction are compared: Gaussian, with zero phase.

A linear chain is the same before and behind it. What is not linear in the commands, such as a rate limit or free play,
must see them before the low-pass, and its output passes it instead: a rate limit follows a step from the step on, but a
smoothed step already from where its slope begins to exceed the limit.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from sysid_node.sim.model.layout import Scalar

Array = NDArray[np.float64]

#: Frequency at which the gain is 0.707, as a share of the rate at which the output is sampled.
CORNER = 0.22

#: Standard deviation of the Gaussian, in samples of the output.
SPREAD = float(np.sqrt(np.log(2.0)) / (2.0 * np.pi * CORNER))

#: Taps to each side of compiled filters: five standard deviations of up to four samples for one of the output.
_HALF = 12


def gaussian_taps(rate: float, kept: float) -> Array:
    """Taps at a rate (Hz) for an output that is ``kept`` at another (Hz), five standard deviations to each side.

    One tap where the rate is too low.
    """
    if rate <= 2.2 * CORNER * kept:
        return np.ones(1)
    spread = SPREAD * rate / kept
    half = int(5.0 * spread)
    taps: Array = np.exp(-0.5 * (np.arange(-half, half + 1) / spread) ** 2)
    taps /= taps.sum()
    return taps


def low_passed(values: Array, taps: Array) -> Array:
    """A series (N,) through a symmetric filter, without delay; its ends are held."""
    half = taps.size // 2
    padded = np.pad(values, half, mode="edge")
    low: Array = fftconvolve(padded, taps, mode="valid")
    return low


def low_passed_every(series: Scalar, factor: int) -> Scalar:
    """The same of a series (N factor, ...), of which each ``factor``-th sample is kept: (N, ...)."""
    count, offsets = series.shape[0], jnp.arange(-_HALF, _HALF + 1)
    taps = jnp.exp(-0.5 * (offsets / (factor * SPREAD)) ** 2)
    padded = jnp.pad(series, [(_HALF, _HALF)] + [(0, 0)] * (series.ndim - 1), mode="edge")
    parts = [tap * padded[i : i + count : factor] for i, tap in enumerate(jnp.unstack(taps / taps.sum()))]
    return sum(parts[1:], parts[0])
