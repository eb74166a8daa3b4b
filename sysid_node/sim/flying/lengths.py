"""Flights padded to few lengths: each length of arrays needs a program of its own, which takes seconds to compile."""

from __future__ import annotations

from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.sim.flying.rollout import SimulatedFlight

_Series = TypeVar("_Series")

#: The shortest length, samples; each next one is twice as long, up to ``_BLOCK``, and then a multiple of that. Flights
#: of 15 s, half a minute, one and two minutes at 100 Hz, with their last samples, fit closely.
_SHORTEST, _BLOCK = 768, 12288


def padded_length(samples: int) -> int:
    """The length to which a flight of so many samples is padded."""
    length = _SHORTEST
    while length < min(samples, _BLOCK):
        length *= 2
    return length if samples <= length else -(-samples // _BLOCK) * _BLOCK


def on_device(values: NDArray[Any]) -> jax.Array:
    """An array of JAX. ``jnp.asarray`` would compile a program for each new shape."""
    array: jax.Array = jax.device_put(values)
    return array


def padded(series: _Series) -> _Series:
    """A tree of series (N, ...) with their last values repeated up to ``padded_length``.

    NumPy does it, so that padding itself compiles nothing, except where many flights are flown at once and the series
    are being traced.
    """

    def longer(values: jax.Array) -> jax.Array:
        missing = padded_length(len(values)) - len(values)
        width = [(0, missing)] + [(0, 0)] * (values.ndim - 1)
        if isinstance(values, jax.core.Tracer):
            return jnp.pad(values, width, mode="edge")
        return on_device(np.pad(values, width, mode="edge"))

    longest: _Series = jax.tree.map(longer, series)
    return longest


def cut(flight: SimulatedFlight, samples: int) -> SimulatedFlight:
    """The first samples of a flight that was padded."""
    return SimulatedFlight(
        *(s[:samples] if isinstance(s, jax.core.Tracer) else on_device(np.asarray(s)[:samples]) for s in flight)
    )
