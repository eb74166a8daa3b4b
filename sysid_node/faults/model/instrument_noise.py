"""The least that the noise of the instruments leaves of a block, by the aircraft file.

A flight of a simulator without noise leaves residuals that are model errors alone: what the aircraft does beyond the
linear model, or interpolation between messages. They are tiny, but neither random nor normally distributed. Compared
with themselves they would prove a fault, however small. Therefore instruments count as no more than ``BETTER`` times as
good as the file says they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS, LONGITUDINAL
from sysid_node.online.frequency.regression_signals import momentum_matrix

Array = NDArray[np.float64]

BETTER = 2.0  # times as good as the file says that instruments may be


def least_variances(aircraft: Aircraft, samples: float, period: float) -> Array:
    """(6,) variance of each coefficient's residual over a block of ``period`` s and so many ``samples``.

    It is that of the accelerometer and the vanes, averaged over the block, and of the gyroscope at the block's ends.
    The increment of angular momentum has twice the gyroscope's variance; half of that is known from the block before.
    """
    noise, reference = aircraft.noise, aircraft.reference
    force = aircraft.mass / (0.5 * reference.air_density * reference.airspeed**2 * aircraft.geometry.S)
    found = np.zeros(len(COEFFICIENTS))
    for place, coefficient in enumerate(COEFFICIENTS):
        vane = "alpha" if coefficient in LONGITUDINAL else "beta"
        derivative = aircraft.derivatives.get(f"{coefficient}_{vane}")
        found[place] = ((derivative.value if derivative else 0.0) * noise[vane]) ** 2 / samples
        if coefficient in ("CL", "CD", "CY"):
            found[place] += (force * noise["accel"]) ** 2 / samples
    moments = [COEFFICIENTS.index(name) for name in ("Cl", "Cm", "Cn")]
    found[moments] += (momentum_matrix(aircraft)[:, 3:] ** 2).sum(axis=0) * (noise["gyro"] / period) ** 2
    return found / BETTER**2
