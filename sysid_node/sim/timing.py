"""Signals shifted in time by a part of a sample."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.layout import Scalar


def shift_linear(series: Scalar, samples: Scalar) -> Scalar:
    """``series`` (N, ...) at k - samples, linear between samples, held at both ends; for commands.

    Exact for a signal that is linear between samples. Its derivative jumps where ``samples`` is whole.
    """
    n = series.shape[0]
    position = jnp.arange(n) - samples
    low = jnp.floor(position)
    weight = _column(position - low, series)
    return (1.0 - weight) * _held(series, low) + weight * _held(series, low + 1)


def shift_cubic(series: Scalar, samples: Scalar) -> Scalar:
    """``series`` (N, ...) at k - samples, Catmull-Rom cubic between samples, held at both ends; for motion.

    Once differentiable in ``samples``: at a whole number of samples the derivative is the central difference.
    """
    n = series.shape[0]
    position = jnp.arange(n) - samples
    low = jnp.floor(position)
    s = _column(position - low, series)
    a, b, c, d = (_held(series, low + i) for i in (-1, 0, 1, 2))
    return b + 0.5 * s * (c - a + s * (2 * a - 5 * b + 4 * c - d + s * (3 * (b - c) + d - a)))


def _held(series: Scalar, index: Scalar) -> Scalar:
    """Rows of a series, the first and last held beyond the ends."""
    return series[jnp.clip(index, 0, series.shape[0] - 1).astype(jnp.int32)]


def _column(weight: Scalar, series: Scalar) -> Scalar:
    """A weight per row, shaped to multiply the series."""
    return weight.reshape((-1,) + (1,) * (series.ndim - 1))
