"""Turbulence as further states, for filters that follow the aircraft through it.

Each gust is white noise through a first-order filter, after the Dryden spectra of MIL-F-8785C (1980), sec. 3.7: the
air's velocity along the body axes, and its rolling. Vertical and lateral gusts that change along the body act
like a pitching and a yawing motion of the air (frozen turbulence), low-passed by the size of the aircraft. How much of
that turning there is, the flight must say: it depends on how the gusts lie to the body, and on what the air is like.
Small eddies drift with the large ones, so that what counts is the speed relative to the gusting air (Tennekes,
"Eulerian and Lagrangian time microscales in isotropic turbulence", J. Fluid Mech. 67, 1975).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp

from sysid_node.batch.models.model import Parameter

Signals = Mapping[str, jax.Array]

#: Gust states by the state of the aircraft that they act through: the air's velocity along body axes, and as the size
#: of the aircraft sees it, m/s; its roll rate, rad/s.
GUSTS = {"V": ("gust_u",), "alpha": ("gust_w", "seen_w"), "beta": ("gust_v", "seen_v"), "p": ("gust_p",)}

#: The states that random noise drives, with its size in light turbulence (unit per root second; 0: unknown); the others
#: follow. Pitch and yaw are driven beside the gusts by what moments the gusts' model leaves over.
DRIVEN = {"q": 0.0, "r": 0.0, "gust_u": 0.5, "gust_v": 0.5, "gust_w": 0.5, "gust_p": 0.5}

#: s: memory of the gusts. Dryden's is length over airspeed, 1 to 30 s, but height and air decide it: with a long one,
#: what a gust does within a manoeuvre is free, and nothing is claimed of the mean of minutes.
_MEMORY = 20.0

#: Shares of the turning that frozen turbulence would have, by the state that brings it about.
_TURNING = {"seen_w": "gust_pitching", "seen_v": "gust_yawing"}


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
    flow = _flow(s)
    relative = dict(s) | {name: flow[name] for name in flow if GUSTS[name][0] in s}
    if "gust_p" in s:
        relative["p"] = s["p"] - s["gust_p"]
    if "seen_w" in s:
        relative["q"] = s["q"] + s["gust_pitching"] * (s["gust_w"] - s["seen_w"]) / (
            flow["V"] * _pitch_time(flow, span)
        )
    if "seen_v" in s:
        relative["r"] = s["r"] - s["gust_yawing"] * (s["gust_v"] - s["seen_v"]) / (flow["V"] * _yaw_time(flow, span))
    return relative


def gust_rates(s: Signals, span: float) -> dict[str, jax.Array]:
    """Derivatives of the gust states without their driving noise."""
    flow = _flow(s)
    rates = {name: -s[name] / _MEMORY for name in ("gust_u", "gust_v", "gust_w") if name in s}
    if "gust_p" in s:
        rates["gust_p"] = -s["gust_p"] / _pitch_time(flow, span)
    if "seen_w" in s:
        rates["seen_w"] = (s["gust_w"] - s["seen_w"]) / _pitch_time(flow, span)
    if "seen_v" in s:
        rates["seen_v"] = (s["gust_v"] - s["seen_v"]) / _yaw_time(flow, span)
    return rates


def _flow(s: Signals) -> dict[str, jax.Array]:
    """V, alpha, beta relative to the gusting air."""
    forward, still = s["V"] * jnp.cos(s["beta"]), jnp.zeros_like(s["V"])
    u = forward * jnp.cos(s["alpha"]) - s.get("gust_u", still)
    v = s["V"] * jnp.sin(s["beta"]) - s.get("gust_v", still)
    w = forward * jnp.sin(s["alpha"]) - s.get("gust_w", still)
    speed = jnp.sqrt(u**2 + v**2 + w**2)
    return {"V": speed, "alpha": jnp.arctan2(w, u), "beta": jnp.arcsin(v / speed)}


def _pitch_time(flow: Signals, span: float) -> jax.Array:
    """Time constant, s, of pitching and rolling gusts: 4 b / (pi V)."""
    return 4.0 * span / (math.pi * flow["V"])


def _yaw_time(flow: Signals, span: float) -> jax.Array:
    """Time constant, s, of yawing gusts: 3 b / (pi V)."""
    return 3.0 * span / (math.pi * flow["V"])
