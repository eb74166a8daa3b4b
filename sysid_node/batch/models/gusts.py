"""Turbulence as further states, for filters that follow the aircraft through it.

Each gust is white noise through a first-order filter, after the Dryden spectra of MIL-F-8785C (1980), sec. 3.7: along
the path, vertical and lateral (as angles), and rolling. Vertical and lateral gusts that change along the body act
like a pitching and a yawing motion of the air (frozen turbulence), low-passed by the size of the aircraft. How much of
that turning there is, the flight must say: it depends on how the gusts lie to the body, and on what the air is like.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp

from sysid_node.batch.model import Parameter

Signals = Mapping[str, jax.Array]

#: Gust states by the state that they act through: along the path m/s; angles rad, and as the size of the aircraft
#: sees them; roll rate rad/s.
GUSTS = {"V": ("gust_V",), "alpha": ("gust_alpha", "seen_alpha"), "beta": ("gust_beta", "seen_beta"), "p": ("gust_p",)}

#: The states that random noise drives; the others follow. Pitch and yaw are driven beside the gusts by what moments the
#: gusts' model leaves over.
DRIVEN = ("q", "r", "gust_V", "gust_alpha", "gust_beta", "gust_p")

#: Gust states whose start is of no account after a span or two of flight.
SOON_FORGOTTEN = ("gust_p", "seen_alpha", "seen_beta")

#: s: memory of the gusts. Dryden's is length over airspeed, 1 to 30 s, but height and air decide it: with a long one,
#: what a gust does within a manoeuvre is free, and nothing is claimed of the mean of minutes.
_MEMORY = 20.0

#: Shares of the turning that frozen turbulence would have, by the state that brings it about.
_TURNING = {"seen_alpha": "gust_pitching", "seen_beta": "gust_yawing"}


def gust_states(states: Sequence[str]) -> tuple[str, ...]:
    """The gust states that belong to these states of the aircraft."""
    return tuple(gust for state in states for gust in GUSTS.get(state, ()))


def gust_parameters(states: Sequence[str]) -> tuple[Parameter, ...]:
    """How much the gusts turn the air: 1 as frozen turbulence does, 0 not at all; estimated, and not the aircraft's."""
    return tuple(Parameter(name, 1.0, prior=(1.0, 1.0)) for state, name in _TURNING.items() if state in states)


def air_relative(s: Signals, span: float) -> dict[str, jax.Array]:
    """V, alpha, beta, p, q, r relative to the gusting air; signals without gusts come back as they are.

    ``s`` holds the states and the shares of turning; ``span`` m.
    """
    relative = dict(s)
    for name in ("V", "alpha", "beta", "p"):
        if f"gust_{name}" in s:
            relative[name] = s[name] + s[f"gust_{name}"]
    if "seen_alpha" in s:
        relative["q"] = s["q"] - s["gust_pitching"] * (_across(s, "alpha") - s["seen_alpha"]) / _pitch_time(s, span)
    if "seen_beta" in s:
        relative["r"] = s["r"] + s["gust_yawing"] * (_across(s, "beta") - s["seen_beta"]) / _yaw_time(s, span)
    return relative


def gust_rates(s: Signals, span: float) -> dict[str, jax.Array]:
    """Derivatives of the gust states without their driving noise."""
    rates = {name: -s[name] / _MEMORY for name in ("gust_V", "gust_alpha", "gust_beta") if name in s}
    if "gust_p" in s:
        rates["gust_p"] = -s["gust_p"] / _pitch_time(s, span)
    if "seen_alpha" in s:
        rates["seen_alpha"] = (_across(s, "alpha") - s["seen_alpha"]) / _pitch_time(s, span)
    if "seen_beta" in s:
        rates["seen_beta"] = (_across(s, "beta") - s["seen_beta"]) / _yaw_time(s, span)
    return rates


def _across(s: Signals, angle: str) -> jax.Array:
    """The gust across the body's axis over the airspeed: of a gust along the path, the flow angle's share is across."""
    along = s["gust_V"] * jnp.sin(s[angle]) / s["V"] if "gust_V" in s else 0.0
    return s[f"gust_{angle}"] + along


def _pitch_time(s: Signals, span: float) -> jax.Array:
    """Time constant, s, of pitching and rolling gusts: 4 b / (pi V)."""
    return 4.0 * span / (math.pi * s["V"])


def _yaw_time(s: Signals, span: float) -> jax.Array:
    """Time constant, s, of yawing gusts: 3 b / (pi V)."""
    return 3.0 * span / (math.pi * s["V"])
