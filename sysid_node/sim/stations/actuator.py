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
from sysid_node.sim.effects.actuator_lag import Transition
from sysid_node.sim.effects.base import of_control
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar, Values

#: Effects between a command and the actuator's position, which have a state.
SERVOS = frozenset(effect.EFFECT.name for effect in (actuator_lag, actuator_backlash, actuator_rate_limit))


class ActuatorState(NamedTuple):
    """The state of the actuators, rad; each (controls,)."""

    command: Scalar  # of the last sample
    lagged: Scalar
    lag_rate: Scalar  # rad/s
    linked: Scalar  # after the free play
    position: Scalar  # after the rate limit


def start(model: AircraftNumbers, command: Scalar) -> ActuatorState:
    """The state at rest on a command (controls,), rad."""
    limited = jnp.clip(command, -model.limits, model.limits)
    return ActuatorState(limited, limited, jnp.zeros_like(limited), limited, limited)


def lags(layout: ParameterLayout, effects: dict[str, Values], step: Scalar) -> Transition:
    """The transitions (controls,) of the actuators' lags over one sample (``step`` s)."""
    values = effects["actuator_lag"]
    tau = jnp.stack([of_control(values, "time_constant", control) for control in layout.controls])
    return actuator_lag.transition(tau, values["damping"], step)


def rate_limits(layout: ParameterLayout, effects: dict[str, Values]) -> Scalar:
    """The inverse (controls,) of the largest rates, s/rad."""
    values = effects["actuator_rate_limit"]
    return jnp.stack([of_control(values, "inverse_rate", control) for control in layout.controls])


class Servos(NamedTuple):
    """What is constant of the actuators during a flight; each (controls,)."""

    lag: Transition
    inverse_rate: Scalar  # s/rad

    @classmethod
    def of(cls, layout: ParameterLayout, effects: dict[str, Values], step: Scalar) -> Servos:
        """The actuators with these effects, at samples every ``step`` s."""
        return cls(lags(layout, effects, step), rate_limits(layout, effects))


def advance(
    layout: ParameterLayout,
    model: AircraftNumbers,
    effects: dict[str, Values],
    servos: Servos,
    state: ActuatorState,
    command: Scalar,
    step: Scalar,
) -> ActuatorState:
    """The state one sample (``step`` s) later; ``command`` (controls,) is that of the new sample, rad."""
    limited = jnp.clip(command, -model.limits, model.limits)
    lagged, rate = actuator_lag.advance(servos.lag, state.lagged, state.lag_rate, state.command, limited, step)
    linked = jnp.stack(
        [
            actuator_backlash.advance(effects["actuator_backlash"], control, state.linked[i], lagged[i])
            for i, control in enumerate(layout.controls)
        ]
    )
    position = actuator_rate_limit.advance(servos.inverse_rate, state.position, linked, step)
    return ActuatorState(limited, lagged, rate, linked, position)


def positions(layout: ParameterLayout, effects: dict[str, Values], actuators: Scalar, time: Scalar) -> list[Scalar]:
    """Position of each surface, rad, from the positions of the actuators (..., controls), at a time (s)."""
    surfaces = []
    for i, control in enumerate(layout.controls):
        x = actuator_bias.apply(effects["actuator_bias"], control, actuators[..., i])
        surfaces.append(stuck_surface.apply(effects["stuck_surface"], control, x, time))
    return surfaces


def effective(
    layout: ParameterLayout, effects: dict[str, Values], surfaces: list[Scalar], time: Scalar
) -> list[Scalar]:
    """Effective deflections, rad: those of a faultless aircraft with the same forces, at a time (s)."""
    loss = effects["control_effectiveness_loss"]
    return [
        control_effectiveness_loss.apply(loss, control, x, time)
        for control, x in zip(layout.controls, surfaces, strict=True)
    ]
