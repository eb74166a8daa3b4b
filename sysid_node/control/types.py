"""Inputs and outputs of the controller. SI units, radians, body axes forward-right-down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Measurements(NamedTuple):
    """The measurements at a time (s). NaN = not measured, or too old."""

    time: float
    p: float  # rad/s
    q: float
    r: float
    phi: float  # rad
    theta: float
    airspeed: float  # m/s
    alpha: float  # rad
    beta: float
    density: float  # kg/m^3


class SetPoints(NamedTuple):
    """Set-points. NaN stands for zero roll and sideslip, the pitch of level flight, and the reference airspeed.

    A finite ``pitch_rate`` (rad/s) is tracked instead of ``pitch`` (rad).
    """

    roll: float = math.nan
    pitch: float = math.nan
    sideslip: float = math.nan
    airspeed: float = math.nan  # m/s
    pitch_rate: float = math.nan


class IdentifiedDerivative(NamedTuple):
    """An identified derivative with its 95 % interval, and R^2 of its coefficient's equation."""

    value: float
    lower: float
    upper: float
    valid: bool
    r_squared: float  # 0..1, share of the coefficient's variance that the model explains


class ErrorCorrelation(NamedTuple):
    """The correlation of the errors of D identified derivatives."""

    names: tuple[str, ...]
    matrix: Array  # (D, D)

    def of(self, names: Sequence[str]) -> Array | None:
        """(n, n) that of n derivatives; None where it lacks one of them."""
        if not set(names) <= set(self.names):
            return None
        places = [self.names.index(name) for name in names]
        return np.asarray(self.matrix[np.ix_(places, places)])


class Command(NamedTuple):
    """Controls (rad) and thrust (N): always finite, within their limits."""

    elevator: float
    aileron: float
    rudder: float
    thrust: float
