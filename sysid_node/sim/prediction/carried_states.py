"""States that depend on the past of commands and flow: actuators, motor and flow separation, sample by sample."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from sysid_node.sim.effects import actuator_lag, stall_separation
from sysid_node.sim.effects.actuator_lag import first_order
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.prediction.active_effects import EffectActs, evaluate_if
from sysid_node.sim.prediction.true_motion import TrueMotion, flow_at
from sysid_node.sim.signals.low_pass import low_passed_every
from sysid_node.sim.stations import actuator, command, propulsion
from sysid_node.sim.stations.actuator import ActuatorState, Servos


class CarriedStates(NamedTuple):
    """States that do not depend on the forces that they cause, N samples."""

    actuators: Scalar  # (N, controls) rad
    motor: Scalar  # (N,) N
    separation: Scalar  # (N,) attached fraction of the flow, 0 to 1


def carried_states(
    chain: Chain, motion: TrueMotion, acts: EffectActs, unfiltered: Scalar | None = None
) -> CarriedStates:
    """The states at each sample of the motion (N,), settled on the first sample.

    ``unfiltered`` (N, K, controls) are the recorded commands before a low-pass, see ``MeasuredSignals``.
    """
    return CarriedStates(
        _actuators(chain, motion.command[:, :-1], acts, unfiltered),
        _motor(chain, motion.command[:, -1], acts),
        evaluate_if(acts("stall_separation"), lambda: _separation(chain, motion), lambda: jnp.ones_like(motion.time)),
    )


def _actuators(chain: Chain, commands: Scalar, acts: EffectActs, unfiltered: Scalar | None) -> Scalar:
    """Actuator positions (N, controls), rad, from the commands (N, controls) that reach them."""
    limited = jnp.clip(commands, -chain.model.limits, chain.model.limits)

    def follow() -> Scalar:
        def step(last: tuple[Scalar, Scalar, Scalar], now: Scalar) -> tuple[tuple[Scalar, Scalar, Scalar], Scalar]:
            x, rate, before = last
            x, rate = actuator_lag.advance(chain.servos.lag, x, rate, before, now, chain.step)
            return (x, rate, now), x

        return jax.lax.scan(step, (limited[0], jnp.zeros_like(limited[0]), limited[0]), limited)[1]

    def linear() -> Scalar:
        return evaluate_if(acts("actuator_lag"), follow, lambda: limited)

    play, limit = acts("actuator_backlash"), acts("actuator_rate_limit")
    abrupt = None if play is None or limit is None else play | limit
    if unfiltered is None:
        return evaluate_if(abrupt, lambda: _moved(chain, commands, chain.servos, chain.step), linear)
    return evaluate_if(abrupt, lambda: actuators_of(chain, unfiltered), linear)


def actuators_of(chain: Chain, unfiltered: Scalar) -> Scalar:
    """Low-passed actuator positions (N, controls), rad, from recorded commands (N, K, controls) before the low-pass."""
    samples, factor, controls = unfiltered.shape
    step = chain.step / factor
    arriving = command.arrive(chain.layout, chain.effects, unfiltered.reshape(samples * factor, controls), step)
    moved = _moved(chain, arriving, Servos.of(chain.layout, chain.effects, step), step)
    return low_passed_every(moved, factor)


def _moved(chain: Chain, commands: Scalar, servos: Servos, step: Scalar) -> Scalar:
    """Actuator positions (N, controls), rad, under commands (N, controls) every ``step`` s, by all their stages."""

    def advance(state: ActuatorState, now: Scalar) -> tuple[ActuatorState, Scalar]:
        state = actuator.advance(chain.layout, chain.model, chain.effects, servos, state, now, step)
        return state, state.position

    return jax.lax.scan(advance, actuator.start(chain.model, commands[0]), commands)[1]


def _motor(chain: Chain, commands: Scalar, acts: EffectActs) -> Scalar:
    """Thrust (N,) of the motor, N, from its commands (N,), N."""
    attainable = propulsion.commanded(chain.model, commands)
    advance = partial(propulsion.advance, chain.effects, step=chain.step)
    return _lagged(acts("motor_lag"), advance, attainable)


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
