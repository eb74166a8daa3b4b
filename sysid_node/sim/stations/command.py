"""Station ``command``: the commands that reach the actuators, from those given or recorded."""

from __future__ import annotations

import jax.numpy as jnp

from sysid_node.sim.effects.base import THROTTLE, of_control
from sysid_node.sim.model.layout import ParameterLayout, Scalar, Values
from sysid_node.sim.signals.time_shift import shift_columns


def arrive(layout: ParameterLayout, effects: dict[str, Values], commands: Scalar, step: Scalar) -> Scalar:
    """Commands (N, m) as they reach the actuators, from commands as they were recorded; step in s.

    They are those of all controls and the throttle, or of the controls alone.
    """
    late = delays(layout, effects)[: commands.shape[1]] - effects["actuator_stamp_delay"]["delay"]
    return shift_columns(commands, late / step)


def delays(layout: ParameterLayout, effects: dict[str, Values]) -> Scalar:
    """The delay (controls + 1,) of each command, s; the throttle's last."""
    values = effects["command_delay"]
    return jnp.stack([of_control(values, "delay", name) for name in (*layout.controls, THROTTLE)])


def arrive_from_history(layout: ParameterLayout, effects: dict[str, Values], history: Scalar, step: Scalar) -> Scalar:
    """The command (m,) that reaches the actuators now; ``history`` (K, m) of commands, the newest last."""
    position = jnp.arange(history.shape[0])[::-1, None]
    weight = jnp.maximum(1.0 - jnp.abs(position - delays(layout, effects) / step), 0.0)
    # XLA would call a library for a matrix product, outside of the loop's kernel
    return jnp.sum(weight * history, axis=0)
