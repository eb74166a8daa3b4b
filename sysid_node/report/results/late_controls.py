"""Deflections as they were by the servos' estimated times, for what a report draws beside measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.record import Array
from sysid_node.flight.servos import servos_of
from sysid_node.online.systematic.servo_model import of_servo
from sysid_node.online.types import DerivativeEstimate

_EXACT = 1e-4  # s: a control that is less late is drawn as it was recorded


def late_controls(
    aircraft: Aircraft, time: Array, controls: Array, servos: Mapping[str, DerivativeEstimate], *, commanded: bool
) -> Array:
    """Controls (N, m) rad at ``time`` (N,) s behind first-order servos with the estimated times.

    Where deflections follow from commands (``commanded``), they hold the lag that the aircraft file states.
    """
    followed = controls.copy()
    for i, (name, servo) in enumerate(zip(aircraft.controls, servos_of(aircraft)[1:], strict=True)):
        if name not in servos:
            continue
        more = servos[name].value - (of_servo(servo)[0] if commanded else 0.0)
        if math.isfinite(more) and abs(more) > _EXACT:
            followed[:, i] = _behind(time, controls[:, i], more)
    return followed


def _behind(time: Array, values: Array, late: float) -> Array:
    """Values (N,) behind a first-order lag (s); where that is negative, as much earlier."""
    if late < 0.0:
        return np.interp(time - late, time, values)
    from scipy.signal import lfilter  # noqa: PLC0415  # importing it takes half a second

    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + 0.5 * step, step)
    signal = np.interp(even, time, values)
    k = 2.0 * late / step  # the bilinear transform, which keeps the mean delay
    lagged = lfilter([1.0 / (1.0 + k), 1.0 / (1.0 + k)], [1.0, (1.0 - k) / (1.0 + k)], signal - signal[0])
    return np.asarray(np.interp(time, even, lagged + signal[0]), np.float64)
