"""Signals shifted in time by fractions of a sample, and their rates."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from sysid_node.sim.model.layout import Scalar


def shift_linear(series: Scalar, samples: Scalar) -> Scalar:
    """``series`` (N, ...) at k - samples, linear between samples and constant beyond both ends; for commands.

    Exact for a signal that is linear between samples. Its derivative jumps where ``samples`` is whole.
    """
    s, (a, b) = _neighbours(series, samples, 0, 2)
    return (1.0 - s) * a + s * b


def shift_columns(series: Scalar, samples: Scalar) -> Scalar:
    """``shift_linear`` of each column of a series (N, m) by samples (m,) of its own."""
    whole = jnp.floor(-samples)

    def together() -> Scalar:
        _, (a, b) = _neighbours(series, samples[0], 0, 2)
        s = -samples - whole
        return (1.0 - s) * a + s * b

    # slices of the whole array are quicker than a gather; they need the same whole number of samples in all columns
    shifted: Scalar = jax.lax.cond(
        jnp.all(whole == whole[0]),
        together,
        lambda: jax.vmap(shift_linear, in_axes=(1, 0), out_axes=1)(series, samples),
    )
    return shifted


def shift_cubic(series: Scalar, samples: Scalar) -> Scalar:
    """``series`` (N, ...) at k - samples, Catmull-Rom cubic between samples, constant beyond the ends; for motion.

    Once differentiable in ``samples``: at a whole number of samples the derivative is the central difference.
    """
    s, (a, b, c, d) = _neighbours(series, samples, -1, 4)
    return b + 0.5 * s * (c - a + s * (2 * a - 5 * b + 4 * c - d + s * (3 * (b - c) + d - a)))


def shift_near_zero(series: Scalar, samples: Scalar) -> Scalar:
    """``shift_cubic`` linearised at a shift of 0, where it is exact; ``samples`` may differ between columns."""
    before = jnp.concatenate([series[:1], series[:-1]])
    after = jnp.concatenate([series[1:], series[-1:]])
    return series - 0.5 * samples * (after - before)


def slope(series: Scalar, step: Scalar) -> Scalar:
    """d/dt of a series (N, ...) by fourth-order central differences; two samples at each end repeat the nearest."""
    inner = (8.0 * (series[3:-1] - series[1:-3]) - (series[4:] - series[:-4])) / (12.0 * step)
    return jnp.concatenate([inner[:1], inner[:1], inner, inner[-1:], inner[-1:]])


def _neighbours(series: Scalar, samples: Scalar, first: int, count: int) -> tuple[Scalar, list[Scalar]]:
    """The fraction, 0 to 1, of k - samples between two samples, and ``count`` neighbouring series from ``first`` on.

    The shift is the same for every row, so that the neighbours are slices of the series with its end values repeated.
    """
    n = series.shape[0]
    whole = jnp.floor(-samples)
    begin = jnp.broadcast_to(series[:1], series.shape)
    end = jnp.broadcast_to(series[-1:], (n + count, *series.shape[1:]))
    start = jnp.clip(n + whole.astype(jnp.int32) + first, 0, 2 * n)
    window = jax.lax.dynamic_slice_in_dim(jnp.concatenate([begin, series, end]), start, n + count - 1)
    return -samples - whole, [window[i : i + n] for i in range(count)]
