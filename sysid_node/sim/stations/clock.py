"""Station ``clock``: the stamps of the messages."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from sysid_node.sim.model.layout import Scalar, Values
from sysid_node.sim.signals.time_shift import shift_cubic, shift_near_zero

_IMU, _AIR = 9, 3  # columns of the outputs that the IMU's and the air data's messages carry


def stamp(effects: dict[str, Values], outputs: Scalar, step: Scalar) -> Scalar:
    """Outputs (N, 12) at the times of their stamps, from outputs at the times of measurement; step in s."""
    imu, air = (effects[name]["delay"] / step for name in ("imu_delay", "air_data_delay"))
    late = jnp.concatenate([jnp.full(_IMU, imu), jnp.full(_AIR, air)])
    # most flights have no such delay, and then the derivatives along the delays need no shifted copies
    stamped: Scalar = jax.lax.cond(jnp.all(late == 0.0), shift_near_zero, _shift_each, outputs, late)
    return stamped


def _shift_each(outputs: Scalar, late: Scalar) -> Scalar:
    imu, air = outputs[:, :_IMU], outputs[:, _IMU:]
    return jnp.concatenate([shift_cubic(imu, late[0]), shift_cubic(air, late[-1])], axis=1)
