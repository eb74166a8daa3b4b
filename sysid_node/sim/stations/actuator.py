"""Station ``actuator``: from commands to surface positions, and to the deflections that count.

lag -> backlash -> rate limit -> bias -> jam gives the position; the loss of effectiveness comes after it.
The state is advanced once a sample; between samples a surface moves linearly.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from sysid_node.sim.effects import (
    actuator_backlash,
    actuator_bias,
    actuator_lag,
    actuator_rate_limit,
    control_effectiveness_loss,
    stuck_surface,
)
from sysid_node.sim.model.layout import Layout, Model, Scalar, Values


class ActuatorState(NamedTuple):
    """What the actuators remember, rad; each (controls,)."""

    command: Scalar  # the last one
    lagged: Scalar
    linked: Scalar  # behind the free play
    position: Scalar  # behind the rate limit


def start(model: Model, command: Scalar) -> ActuatorState:
    """At rest on a command (controls,)."""
    limited = jnp.clip(command, -model.limits, model.limits)
    return ActuatorState(limited, limited, limited, limited)


def advance(
    layout: Layout, model: Model, effects: dict[str, Values], state: ActuatorState, command: Scalar, step: Scalar
) -> ActuatorState:
    """One sample on; ``command`` (controls,) is that of the new sample."""
    limited = jnp.clip(command, -model.limits, model.limits)
    lagged, linked, position = [], [], []
    for i, control in enumerate(layout.controls):
        lag = actuator_lag.advance(effects["actuator_lag"], state.lagged[i], state.command[i], limited[i], step)
        link = actuator_backlash.advance(effects["actuator_backlash"], control, state.linked[i], lag)
        reach = actuator_rate_limit.advance(effects["actuator_rate_limit"], state.position[i], link, step)
        lagged.append(lag)
        linked.append(link)
        position.append(reach)
    return ActuatorState(limited, jnp.stack(lagged), jnp.stack(linked), jnp.stack(position))


def positions(layout: Layout, effects: dict[str, Values], actuators: Scalar, time: Scalar) -> list[Scalar]:
    """Where each surface stands, rad, by where the actuators (..., controls) do."""
    surfaces = []
    for i, control in enumerate(layout.controls):
        x = actuator_bias.apply(effects["actuator_bias"], control, actuators[..., i])
        surfaces.append(stuck_surface.apply(effects["stuck_surface"], control, x, time))
    return surfaces


def effective(layout: Layout, effects: dict[str, Values], surfaces: list[Scalar], time: Scalar) -> list[Scalar]:
    """The deflections that count, rad."""
    loss = effects["control_effectiveness_loss"]
    return [
        control_effectiveness_loss.apply(loss, control, x, time)
        for control, x in zip(layout.controls, surfaces, strict=True)
    ]
