"""Lag of the actuators, of first or second order."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from sysid_node.sim.effects.base import Effect, SimulationParameter, each_control
from sysid_node.sim.model.layout import Scalar

EFFECT = Effect(
    name="actuator_lag",
    station="actuator",
    summary="Surfaces follow their commands with a lag of first order, or with a damping of second order.",
    equation=(
        "T x' + x = u, or with damping T^2 x'' + 2 damping T x' + x = u, T the time constant; "
        "solved exactly for u linear between samples"
    ),
    source="Stevens, Lewis & Johnson (2016), Aircraft Control and Simulation (actuators of the F-16 model)",
    parameters=each_control(
        SimulationParameter("time_constant", "s", "time constant", 0.05, lower=0.0, upper=1.0),
        SimulationParameter("damping", "1", "of second order; 0: first order", 0.3, 0.0, 0.0, 10.0, switch=False),
    ),
    shared="time_constant",
)


class Transition(NamedTuple):
    """How the error of an actuator from its command, and its rate, pass from one sample to the next."""

    lateness: Scalar  # s, by which a steady ramp is followed
    error_of_error: Scalar
    error_of_rate: Scalar  # s
    rate_of_error: Scalar  # 1/s
    rate_of_rate: Scalar


def transition(tau: Scalar, damping: Scalar, step: Scalar) -> Transition:
    """The transition over one step (s) of a lag with time constant ``tau`` (s), of second order where damping > 0.

    exp(A h) of a system of second order: Franklin, Powell & Workman (1998), Digital Control of Dynamic Systems, 4.3.
    """
    settling = jnp.maximum(tau, step / 50.0)
    decay, zero = jnp.exp(-step / settling), jnp.zeros_like(settling)
    second = (damping > 0.0) & (tau > step / 50.0)
    z, w = jnp.where(second, damping, 1.0), 1.0 / settling
    cosine, sine = _oscillation(z, w, step)
    whole = Transition(2.0 * z * tau, cosine + z * w * sine, sine, -w * w * sine, cosine - z * w * sine)
    first = Transition(tau, decay, zero, zero, zero)
    return Transition(*(jnp.where(second, b, a) for a, b in zip(first, whole, strict=True)))


def _oscillation(z: Scalar, w: Scalar, step: Scalar) -> tuple[Scalar, Scalar]:
    """exp(-z w h) times cosh(r h) and sinh(r h) / r with r = w sqrt(z^2 - 1), which may be imaginary."""
    square = w * w * (z * z - 1.0)
    near = jnp.abs(square) * step * step < 1e-6
    over, under = ~near & (square > 0.0), ~near & (square < 0.0)
    r, s = jnp.sqrt(jnp.where(over, square, 1.0)), jnp.sqrt(jnp.where(under, -square, 1.0))
    fade = jnp.exp(-z * w * step)
    slow, fast = jnp.exp(-w * w / (z * w + r) * step), jnp.exp(-(z * w + r) * step)
    series = jnp.where(near, square, 0.0) * step * step  # the first terms of the power series about damping 1
    cosine = jnp.where(over, 0.5 * (slow + fast), fade * jnp.where(under, jnp.cos(s * step), 1.0 + series / 2.0))
    sine = jnp.where(
        over, 0.5 * (slow - fast) / r, fade * jnp.where(under, jnp.sin(s * step) / s, step * (1.0 + series / 6.0))
    )
    return cosine, sine


def advance(past: Transition, x: Scalar, rate: Scalar, u0: Scalar, u1: Scalar, step: Scalar) -> tuple[Scalar, Scalar]:
    """The lagged position (rad) and its rate (rad/s) one step (s) later, as the command goes from u0 to u1 (rad)."""
    slope = (u1 - u0) / step
    behind = past.lateness * slope
    error, turning = x - u0 + behind, rate - slope
    position = u1 - behind + past.error_of_error * error + past.error_of_rate * turning
    return position, slope + past.rate_of_error * error + past.rate_of_rate * turning


def first_order(tau: Scalar, x: Scalar, u0: Scalar, u1: Scalar, step: Scalar) -> Scalar:
    """x one step later by tau dx/dt + x = u, exact for u linear in time.

    At tau = 0 it is u1, and its derivative with respect to tau is that of a delay.
    """
    decay = jnp.exp(-step / jnp.maximum(tau, step / 50.0))
    ramp = tau / step * (1.0 - decay)
    return decay * x + (ramp - decay) * u0 + (1.0 - ramp) * u1


def first_order_series(tau: Scalar, series: Scalar, step: Scalar, start: Scalar) -> Scalar:
    """A series (N, ...) through ``first_order``, from an output ``start`` (...) before the first sample."""

    def advance(last: Scalar, pair: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
        now = first_order(tau, last, *pair, step)
        return now, now

    before = jnp.concatenate([series[:1], series[:-1]])
    lagging: Scalar = jax.lax.scan(advance, start, (before, series))[1]
    return lagging
