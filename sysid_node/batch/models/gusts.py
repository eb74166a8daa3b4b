"""Turbulence as further states of a model, for filter error.

Each gust is white noise through a first-order filter, after the Dryden spectra of MIL-F-8785C (1980), sec. 3.7: the
air's velocity along the body axes, and its roll rate. Vertical and lateral gusts that change along the body act like a
pitch rate and a yaw rate of the air (frozen turbulence), low-passed by the size of the aircraft. The size of these
rates depends on the gusts' direction to the body and on the air, so that it is estimated. Small eddies drift with the
large ones, so that the gusts pass at the speed relative to the gusting air (Tennekes, "Eulerian and Lagrangian time
microscales in isotropic turbulence", J. Fluid Mech. 67, 1975).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp

from sysid_node.batch.models.model import ModelParameter
from sysid_node.dynamics.airflow import flow_angles, velocity_of

Signals = Mapping[str, jax.Array]

#: Gust states by the state of the aircraft that they act through: the air's velocity along body axes, and as the size
#: of the aircraft sees it, m/s; its roll rate, rad/s.
GUSTS = {"V": ("gust_u",), "alpha": ("gust_w", "seen_w"), "beta": ("gust_v", "seen_v"), "p": ("gust_p",)}

#: The states with process noise, and its 1 sigma in light turbulence (unit per root second; 0: not known). Pitch and
#: yaw rate have process noise besides the gusts, for the moments that the model of the gusts does not explain.
DRIVEN = {"q": 0.0, "r": 0.0, "gust_u": 0.5, "gust_v": 0.5, "gust_w": 0.5, "gust_p": 0.5}

#: s: correlation time of the gusts. Dryden's is scale length over airspeed, 1 to 30 s, depending on height and air. A
#: long one leaves a gust free within a manoeuvre and says nothing of means over minutes.
_CORRELATION_TIME = 20.0

#: Parameters: the air's rotation as a share of that of frozen turbulence, by the state that it follows from.
_ROTATION = {"seen_w": "gust_pitching", "seen_v": "gust_yawing"}


def gust_states(states: Sequence[str]) -> tuple[str, ...]:
    """The gust states that belong to these states of the aircraft."""
    return tuple(gust for state in states for gust in GUSTS.get(state, ()))


def gust_parameters(states: Sequence[str]) -> tuple[ModelParameter, ...]:
    """The parameters of the air's rotation: 1 as in frozen turbulence, 0 none; not derivatives of the aircraft."""
    return tuple(ModelParameter(name, 1.0, prior=(1.0, 1.0)) for state, name in _ROTATION.items() if state in states)


def air_relative(s: Signals, span: float) -> dict[str, jax.Array]:
    """The signals with V, alpha, beta, p, q, r relative to the gusting air; without gust states they are unchanged.

    ``s`` holds the states and the parameters of the air's rotation; ``span`` m.
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
    """The time derivatives of the gust states without their process noise."""
    flow = _flow(s)
    rates = {name: -s[name] / _CORRELATION_TIME for name in ("gust_u", "gust_v", "gust_w") if name in s}
    if "gust_p" in s:
        rates["gust_p"] = -s["gust_p"] / _pitch_time(flow, span)
    if "seen_w" in s:
        rates["seen_w"] = (s["gust_w"] - s["seen_w"]) / _pitch_time(flow, span)
    if "seen_v" in s:
        rates["seen_v"] = (s["gust_v"] - s["seen_v"]) / _yaw_time(flow, span)
    return rates


def _flow(s: Signals) -> dict[str, jax.Array]:
    """V, alpha, beta relative to the gusting air."""
    still = jnp.zeros_like(s["V"])
    gusts = (s.get(name, still) for name in ("gust_u", "gust_v", "gust_w"))
    velocity = velocity_of((s["V"], s["alpha"], s["beta"]), jnp)
    u, v, w = (inertial - gust for inertial, gust in zip(velocity, gusts, strict=True))
    return dict(zip(("V", "alpha", "beta"), flow_angles((u, v, w), jnp), strict=True))


def _pitch_time(flow: Signals, span: float) -> jax.Array:
    """Time constant, s, of the air's pitch and roll rates: 4 b / (pi V)."""
    return 4.0 * span / (math.pi * flow["V"])


def _yaw_time(flow: Signals, span: float) -> jax.Array:
    """Time constant, s, of the air's yaw rate: 3 b / (pi V)."""
    return 3.0 * span / (math.pi * flow["V"])
