"""Station ``actuator``: surface positions and effective deflections from commands.

Lag, backlash, rate limit, bias and jam follow one another and give the position; the loss of effectiveness acts on
that. The state is advanced once a sample; between samples a surface moves linearly.
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
    """The state of the actuators, rad; each (controls,)."""

    command: Scalar  # of the last sample
    lagged: Scalar
    linked: Scalar  # after the free play
    position: Scalar  # after the rate limit


def start(model: Model, command: Scalar) -> ActuatorState:
    """The state at rest on a command (controls,), rad."""
    limited = jnp.clip(command, -model.limits, model.limits)
    return ActuatorState(limited, limited, limited, limited)


def advance(
    layout: Layout, model: Model, effects: dict[str, Values], state: ActuatorState, command: Scalar, step: Scalar
) -> ActuatorState:
    """The state one sample (``step`` s) later; ``command`` (controls,) is that of the new sample, rad."""
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
    """Position of each surface, rad, from the positions of the actuators (..., controls), at a time (s)."""
    surfaces = []
    for i, control in enumerate(layout.controls):
        x = actuator_bias.apply(effects["actuator_bias"], control, actuators[..., i])
        surfaces.append(stuck_surface.apply(effects["stuck_surface"], control, x, time))
    return surfaces


def effective(layout: Layout, effects: dict[str, Values], surfaces: list[Scalar], time: Scalar) -> list[Scalar]:
    """Effective deflections, rad: those of a faultless aircraft with the same forces, at a time (s)."""
    loss = effects["control_effectiveness_loss"]
    return [
        control_effectiveness_loss.apply(loss, control, x, time)
        for control, x in zip(layout.controls, surfaces, strict=True)
    ]
