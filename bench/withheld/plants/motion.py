"""What a plant hands to instruments and autopilot at each instant, and what it is driven by. SI, radians, body FRD."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, Protocol

Triple = tuple[float, float, float]
Effects = Mapping[str, Mapping[str, float]]

GRAVITY = 9.80665


class Instant(NamedTuple):
    """The motion as ideal instruments at the centre of gravity would feel it."""

    force: Triple  # specific force, m/s^2
    turning: Triple  # angular acceleration, rad/s^2
    rates: Triple  # rad/s
    euler: Triple  # roll, pitch, heading, rad
    flow: Triple  # velocity through the air, m/s
    turned: Triple  # rates relative to the air, which may turn, rad/s
    density: float  # kg/m^3


class Flow(NamedTuple):
    """What aerodynamic effects depend on."""

    alpha: float
    beta: float
    p: float  # non-dimensional rates
    q: float
    r: float
    alpha_rate: float  # dalpha/dt cbar / 2V
    CL: float  # of the derivatives alone
    time: float  # s


class Airframe(Protocol):
    """A rigid aircraft that flies on by one step at a time."""

    controls: tuple[str, ...]
    trim: Mapping[str, float]  # deflections (rad) and thrust (N) at which the flight begins
    cg: Triple  # of the true centre of gravity from the file's, m

    def start(self) -> Instant:
        """Back to the trim; the motion there."""
        ...

    def step(self, surfaces: Mapping[str, float], thrust: float, gusts: tuple[float, ...], time: float) -> Instant:
        """One step on, at the end of which it is ``time`` (s). Raises DivergedError."""
        ...

    def meter(self, commanded: float) -> float:
        """What is recorded as thrust (N): the command, or what a meter shows now."""
        ...


class DivergedError(Exception):
    """The flight left what an aircraft can fly."""


def flow_angles(flow: Triple) -> Triple:
    """Airspeed, alpha, beta of a velocity through the air."""
    u, v, w = flow
    forward = math.hypot(u, w)
    return math.hypot(forward, v), math.atan2(w, u), math.atan2(v, forward)


def cross(a: Triple, b: Triple) -> Triple:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
