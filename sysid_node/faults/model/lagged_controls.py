"""Commands through servos whose time is not exactly known.

Where ``actuators`` carries commands, a surface follows the command u through a servo. The response of a servo is taken
as a sum of lags F_T of first order,

    surface = u + sum_j theta_j (F_Tj u - u),        T_j of ``LAGS``,

which has the lateness (first moment) and the second moment of a lag of first order with the time L if

    sum theta_j T_j = L,    sum theta_j T_j^2 = L^2.

This is linear in theta, so that what is not known of a servo is a prior of theta, and blocks of the past stay valid
when more becomes known. For 3-2-1-1s, servos of first order (10 to 200 ms) and of second order (3 to 8 Hz) differ from
such a sum by a quarter of what they are behind by, or less.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.systematic.servo_states import ServoStates

Array = NDArray[np.float64]

LAGS = (0.03, 0.12)  # s
SHAPE = 0.25  # standard deviation of a servo's lateness in each lag, as a share, where only the sum of them is known
LONGEST = 0.25  # s: a lateness beyond this counts as this


class LaggedControls:
    """The controls of an aircraft through each of ``LAGS``."""

    def __init__(self, count: int) -> None:
        self._states = [ServoStates([lag] * count) for lag in LAGS]

    def follow(self, time: float, controls: Sequence[float]) -> list[float]:
        """How far each control is behind at ``time`` (s): F_T u - u (rad) for each control in turn, and each lag."""
        for state in self._states:
            state.follow(time, controls)
        return [state.positions[i] - u for i, u in enumerate(controls) for state in self._states]


def of_record(time: Array, controls: Array) -> Array:
    """(N, m J) what ``LaggedControls`` gives for controls (N, m) at times (N,) s."""
    lagged = LaggedControls(controls.shape[1])
    rows = [lagged.follow(t, row) for t, row in zip(time.tolist(), controls.tolist(), strict=True)]
    return np.array(rows).reshape(time.size, controls.shape[1] * len(LAGS))


def shares_of(lateness: float, error: float) -> tuple[Array, Array]:
    """Mean and standard deviation of theta (J,), for a servo that is late by ``lateness`` (s) with an ``error`` (s)."""
    first, second = LAGS
    late, width = min(max(lateness, 0.0), LONGEST), second - first
    shares = np.array([late * (second - late) / (first * width), late * (late - first) / (second * width)])
    slopes = np.array([(second - 2.0 * late) / (first * width), (2.0 * late - first) / (second * width)])
    return shares, np.hypot(slopes * error, SHAPE * late / np.array(LAGS))
