"""Servos as formats hold them whose actuators are lags of first order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

Effects = Mapping[str, Mapping[str, float]]

#: Time constants below this (s) count as none.
_NONE = 1e-9


def first_order_lags(effects: Effects) -> dict[str, float]:
    """Time constant (s) by control of those that lag.

    A servo of second order follows a ramp by twice damping times time constant late; its lag of first order does, too.
    """
    values = dict(effects.get("actuator_lag", {}))
    damping = values.pop("damping", 0.0)
    shared = values.pop("time_constant", 0.0)
    share = 2.0 * damping if damping else 1.0
    return {name: share * (value + shared) for name, value in values.items() if value + shared > _NONE}


def second_order_line(effects: Effects) -> list[str]:
    """What a first-order lag makes of servos of second order."""
    damping = effects.get("actuator_lag", {}).get("damping", 0.0)
    if not damping or not first_order_lags(effects):
        return []
    return [
        f"actuator_lag of second order (damping {damping:g}): written as one of first order that follows a ramp as "
        f"late; a step's answer differs by up to {step_error(damping):.0%} of the step"
    ]


def step_error(damping: float) -> float:
    """The largest difference of the two answers to a step, as a share of the step."""
    z = damping + (1e-6 if abs(damping - 1.0) < 1e-6 else 0.0)  # the two poles of damping 1 lie on each other
    root = np.sqrt(complex(z * z - 1.0))
    fast, slow = -z - root, -z + root
    time = np.linspace(0.0, 20.0 * max(2.0 * z, 1.0 / z), 20001)
    second = 1.0 + ((slow * np.exp(fast * time) - fast * np.exp(slow * time)) / (fast - slow)).real
    first = 1.0 - np.exp(-time / (2.0 * z))
    return float(np.abs(second - first).max())
