"""States that depend on the past of commands and flow: actuators, motor and flow separation, sample by sample."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from sysid_node.sim.effects import actuator_backlash, actuator_lag, actuator_rate_limit, stall_separation
from sysid_node.sim.effects.actuator_lag import first_order
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.prediction.active_effects import EffectActs, evaluate_if
from sysid_node.sim.prediction.true_motion import TrueMotion, flow_at
from sysid_node.sim.stations import propulsion


class CarriedStates(NamedTuple):
    """States that do not depend on the forces that they cause, N samples."""

    actuators: Scalar  # (N, controls) rad
    motor: Scalar  # (N,) N
    separation: Scalar  # (N,) attached fraction of the flow, 0 to 1


def carried_states(chain: Chain, motion: TrueMotion, acts: EffectActs) -> CarriedStates:
    """The states at each sample of the motion (N,), settled on the first sample."""
    return CarriedStates(
        _actuators(chain, motion.command[:, :-1], acts),
        _motor(chain, motion.command[:, -1], acts),
        evaluate_if(acts("stall_separation"), lambda: _separation(chain, motion), lambda: jnp.ones_like(motion.time)),
    )


def _actuators(chain: Chain, commands: Scalar, acts: EffectActs) -> Scalar:
    """Actuator positions (N, controls), rad, from their commands (N, controls).

    The stages follow one another as in ``actuator.advance`` of the stations.
    """
    effects, h, controls = chain.effects, chain.step, chain.layout.controls

    def linked(x: Scalar, u: Scalar) -> Scalar:
        play = effects["actuator_backlash"]
        return jnp.stack([actuator_backlash.advance(play, name, x[i], u[i]) for i, name in enumerate(controls)])

    def follow() -> Scalar:
        def step(last: tuple[Scalar, Scalar, Scalar], now: Scalar) -> tuple[tuple[Scalar, Scalar, Scalar], Scalar]:
            x, rate, before = last
            x, rate = actuator_lag.advance(chain.servos.lag, x, rate, before, now, h)
            return (x, rate, now), x

        return jax.lax.scan(step, (limited[0], jnp.zeros_like(limited[0]), limited[0]), limited)[1]

    limited = jnp.clip(commands, -chain.model.limits, chain.model.limits)
    rate = partial(actuator_rate_limit.advance, chain.servos.inverse_rate)
    position = evaluate_if(acts("actuator_lag"), follow, lambda: limited)
    position = _carried(acts("actuator_backlash"), linked, position)
    return _carried(acts("actuator_rate_limit"), lambda x, u: rate(x, u, h), position)


def _motor(chain: Chain, commands: Scalar, acts: EffectActs) -> Scalar:
    """Thrust (N,) of the motor, N, from its commands (N,), N."""
    attainable = propulsion.commanded(chain.model, commands)
    advance = partial(propulsion.advance, chain.effects, step=chain.step)
    return _lagged(acts("motor_lag"), advance, attainable)


def _carried(acts: Scalar | None, advance: Callable[[Scalar, Scalar], Scalar], series: Scalar) -> Scalar:
    """The output (N, ...) of x[k] = advance(x[k-1], u[k]) under the series u; the series itself where nothing acts."""

    def step(last: Scalar, now: Scalar) -> tuple[Scalar, Scalar]:
        state = advance(last, now)
        return state, state

    return evaluate_if(acts, lambda: jax.lax.scan(step, series[0], series)[1], lambda: series)


def _lagged(acts: Scalar | None, advance: Callable[[Scalar, Scalar, Scalar], Scalar], series: Scalar) -> Scalar:
    """The output (N, ...) of x[k] = advance(x[k-1], u[k-1], u[k]); the series u itself where nothing acts."""

    def step(last: tuple[Scalar, Scalar], now: Scalar) -> tuple[tuple[Scalar, Scalar], Scalar]:
        state = advance(*last, now)
        return (state, now), state

    return evaluate_if(acts, lambda: jax.lax.scan(step, (series[0], series[0]), series)[1], lambda: series)


def _separation(chain: Chain, motion: TrueMotion) -> Scalar:
    """Attached fraction of the flow (N,)."""
    air, values = flow_at(motion), chain.effects["stall_separation"]
    time_scale = chain.model.chord / air.speed
    attached = stall_separation.attached(values, air.alpha, motion.alpha_rate, time_scale)
    start = stall_separation.attached(values, air.alpha[0], jnp.zeros(()), jnp.zeros(()))

    def advance(last: Scalar, sample: Scalar) -> tuple[Scalar, Scalar]:
        now = first_order(sample[0], last, sample[1], sample[2], chain.step)
        return now, now

    before = jnp.concatenate([start[None], attached[:-1]])
    _, separation = jax.lax.scan(advance, start, jnp.stack([values["tau1"] * time_scale, before, attached], 1))
    return separation
