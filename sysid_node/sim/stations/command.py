"""Station ``command``: the commands that reach the actuators, from those given or recorded."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.model.layout import Scalar, Values
from sysid_node.sim.signals.time_shift import shift_linear


def arrive(effects: dict[str, Values], commands: Scalar, step: Scalar) -> Scalar:
    """Commands (N, m) as they reach the actuators, from commands as they were recorded; step in s."""
    late = effects["command_delay"]["delay"] - effects["actuator_stamp_delay"]["delay"]
    return shift_linear(commands, late / step)


def arrive_from_history(effects: dict[str, Values], history: Scalar, step: Scalar) -> Scalar:
    """The command (m,) that reaches the actuators now; ``history`` (K, m) of commands, the newest last."""
    position = jnp.arange(history.shape[0])[::-1]
    weight = jnp.maximum(1.0 - jnp.abs(position - effects["command_delay"]["delay"] / step), 0.0)
    # XLA would call a library for a matrix product, outside of the loop's kernel
    return jnp.sum(weight[:, None] * history, axis=0)
