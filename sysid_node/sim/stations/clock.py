"""Station ``clock``: when the messages say that it happened."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.layout import Scalar, Values
from sysid_node.sim.timing import shift_cubic

_IMU = 9  # columns of the IMU's messages in the outputs; the rest is air data


def stamp(effects: dict[str, Values], outputs: Scalar, step: Scalar) -> Scalar:
    """Outputs (N, 12) by their stamps, from outputs by the time of measurement; step in s."""
    imu = shift_cubic(outputs[:, :_IMU], effects["imu_delay"]["delay"] / step)
    air = shift_cubic(outputs[:, _IMU:], effects["air_data_delay"]["delay"] / step)
    return jnp.concatenate([imu, air], axis=1)
