"""The reference motion: the response of reference models to the set-points, which the aircraft is to follow.

Pitch and roll have second-order models, sideslip a first-order one. Yaw rate and angle of attack follow from the turn
and from the aircraft's equations (explicit model following: Stevens, Lewis & Johnson (2016), sect. 5.6).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import SetPoints
from sysid_node.dynamics.atmosphere import GRAVITY

T = TypeVar("T")

DAMPING = 0.9
MOST_RATE, MOST_ACCELERATION = 1.5, 8.0  # rad/s, rad/s^2


class ReferenceMotion(NamedTuple):
    """The reference motion at one instant, rad, rad/s, rad/s^2; ``alpha`` is relative to level flight."""

    theta: float
    q: float
    phi: float
    p: float
    r: float
    alpha: float
    beta: float
    q_rate: float = 0.0
    p_rate: float = 0.0
    r_rate: float = 0.0
    turn: float = 0.0  # pitch rate due to the turn, rad/s


class FlightCondition(NamedTuple):
    """The flight condition that the reference depends on."""

    airspeed: float  # m/s
    level: float  # rad, angle of attack of level flight
    side: float  # 1/s, qbar S CY_beta / (m V)
    bandwidth: float  # rad/s
    largest_pitch: float = math.inf  # rad
    largest_roll: float = math.inf  # rad


@dataclass
class ReferenceState:
    """The states of the reference models, rad and rad/s; ``alpha`` is relative to level flight."""

    theta: float
    phi: float = 0.0
    q: float = 0.0
    p: float = 0.0
    beta: float = 0.0
    alpha: float = 0.0


@dataclass
class DelayedReference:
    """The reference after the delay and lag of the actuators, with which the motion is compared."""

    lag: float  # s
    delay: float  # s
    pending: deque[tuple[float, ReferenceMotion]] = field(default_factory=deque)
    now: ReferenceMotion | None = None


def limited(points: SetPoints, level: float, speed: float, settings: ControllerSettings) -> SetPoints:
    """The set-points within their limits; ``level`` pitch (rad) and reference ``speed`` (m/s) replace NaN."""
    usual = SetPoints(roll=0.0, pitch=level, sideslip=0.0, airspeed=speed, pitch_rate=math.nan)
    limits = set_point_limits(speed, settings)
    return SetPoints(
        *(
            otherwise if math.isnan(value) else min(max(value, lower), upper)
            for value, otherwise, (lower, upper) in zip(points, usual, limits.values(), strict=True)
        )
    )


def set_point_limits(speed: float, settings: ControllerSettings) -> Mapping[str, tuple[float, float]]:
    """Least and largest value of each set-point (rad, m/s, rad/s), in their order; ``speed`` (m/s) is the reference."""
    return {
        "roll": (-settings.largest_roll, settings.largest_roll),
        "pitch": (-settings.largest_pitch, settings.largest_pitch),
        "sideslip": (-settings.largest_sideslip, settings.largest_sideslip),
        "airspeed": (0.75 * speed, 1.4 * speed),
        "pitch_rate": (-MOST_RATE, MOST_RATE),
    }


def advance(state: ReferenceState, points: SetPoints, step: float, flight: FlightCondition) -> ReferenceMotion:
    """The reference motion a ``step`` (s) later. The caller moves alpha on, which follows from the elevator."""
    w, level, airspeed = flight.bandwidth, flight.level, flight.airspeed
    q_rate = _pitch_acceleration(state, points, flight)
    p_rate = _within(w * w * (points.roll - state.phi) - 2.0 * DAMPING * w * state.p, MOST_ACCELERATION)
    beta_rate = w * (points.sideslip - state.beta)
    state.q = _within(state.q + q_rate * step, MOST_RATE)
    state.p = _within(state.p + p_rate * step, MOST_RATE)
    state.theta, state.q = _bounded(state.theta, state.q, step, flight.largest_pitch)
    state.phi, state.p = _bounded(state.phi, state.p, step, flight.largest_roll)
    state.beta += beta_rate * step
    sin, cos = math.sin(level), math.cos(level)
    pull = GRAVITY / airspeed * cos
    r = (flight.side * state.beta + sin * state.p + pull * math.sin(state.phi) - beta_rate) / cos
    r_rate = (flight.side * beta_rate + sin * p_rate + pull * math.cos(state.phi) * state.p) / cos
    turn = GRAVITY / airspeed * math.tan(state.phi) * math.sin(state.phi)
    p = state.p - r * math.tan(level)
    return ReferenceMotion(state.theta, state.q, state.phi, p, r, state.alpha, state.beta, q_rate, p_rate, r_rate, turn)


def _pitch_acceleration(state: ReferenceState, points: SetPoints, flight: FlightCondition) -> float:
    """Pitch acceleration (rad/s^2) towards the pitch, or towards the pitch rate where one is asked for.

    Near the largest pitch the rate that is asked for falls in proportion to what is left, at half of the bandwidth:
    with the rate's own model, of twice the bandwidth, this is critically damped, and the pitch does not overshoot.
    """
    w, most = flight.bandwidth, flight.largest_pitch
    if math.isnan(points.pitch_rate):
        return _within(w * w * (points.pitch - state.theta) - 2.0 * DAMPING * w * state.q, MOST_ACCELERATION)
    upper, lower = 0.5 * w * (most - state.theta), 0.5 * w * (-most - state.theta)
    return _within(2.0 * w * (min(max(points.pitch_rate, lower), upper) - state.q), MOST_ACCELERATION)


def _bounded(angle: float, rate: float, step: float, most: float) -> tuple[float, float]:
    """Angle and rate a ``step`` (s) later; the angle does not grow beyond ``most``, but may return from beyond it."""
    later = angle + rate * step
    if abs(later) <= max(most, abs(angle)):
        return later, rate
    return math.copysign(max(most, abs(angle)), later), 0.0


def _within(value: float, most: float) -> float:
    return min(max(value, -most), most)


def delayed(pending: deque[tuple[float, T]], time: float, value: T, delay: float, step: float) -> T:
    """The value given ``delay`` (s) ago, or the oldest known; ``value`` is the present one, at ``time`` (s).

    ``step`` (s) is the time since the last call. The delay is often a whole or a half number of steps. Then rounding
    and jitter of the stamps would decide at every call which of two values it is; they do not at a third of a step.
    """
    if pending and pending[-1][0] > time:
        pending.clear()  # the clock was set back
    pending.append((time, value))
    while len(pending) > 1 and pending[1][0] <= time - delay + step / 3.0:
        pending.popleft()
    return pending[0][1]


def follow(state: DelayedReference, time: float, wanted: ReferenceMotion, step: float) -> ReferenceMotion:
    """The reference after delay and lag, where ``wanted`` is the present one, at ``time`` (s)."""
    late = delayed(state.pending, time, wanted, state.delay, step)
    if state.now is None:
        state.now = late
    share = 1.0 - math.exp(-step / state.lag)
    state.now = ReferenceMotion(*(a + share * (b - a) for a, b in zip(state.now, late, strict=True)))
    return state.now
