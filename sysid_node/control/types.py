"""What goes into and comes out of the controller. SI, radians, body axes forward-right-down."""

from __future__ import annotations

import math
from typing import NamedTuple


class Measurements(NamedTuple):
    """What the sensors say at a time (s). NaN = not measured, or too old."""

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
    """What is asked for. NaN: roll and sideslip zero, pitch of level flight, the reference airspeed.

    A finite ``pitch_rate`` (rad/s) is tracked instead of ``pitch`` (rad).
    """

    roll: float = math.nan
    pitch: float = math.nan
    sideslip: float = math.nan
    airspeed: float = math.nan  # m/s
    pitch_rate: float = math.nan


class IdentifiedDerivative(NamedTuple):
    """A derivative as the identifier has it, with its 95 % interval, and how well its equation holds."""

    value: float
    lower: float
    upper: float
    valid: bool
    explained: float  # 0..1, share of its coefficient's motion that the model explains


class Command(NamedTuple):
    """Controls (rad) and thrust (N): always finite, within their limits."""

    elevator: float
    aileron: float
    rudder: float
    thrust: float
