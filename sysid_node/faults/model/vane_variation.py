"""How little the readings of the vanes have varied: a bound on their noise that the flight itself gives.

The third difference of block means holds the noise, with twenty times its variance, and motion besides. The least mean
square of it in any ``STRETCH`` blocks is therefore no less than the noise's, but for chance. A vane with less noise
than the aircraft file says would otherwise be corrected for noise that it does not have.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STRETCH = 20  # blocks
CHANCE = 3.0  # times the least mean square that the noise's variance may be
_GAIN = 20.0  # of a third difference: 1 + 9 + 9 + 1
_ORDER = 3


@dataclass
class VaneVariation:
    """The least mean square (3,) of third differences of the air data, over their gain; infinite before the first."""

    least: Array = field(default_factory=lambda: np.full(3, np.inf))
    last: deque[Array] = field(default_factory=lambda: deque(maxlen=STRETCH + _ORDER))

    @property
    def most_noise(self) -> Array:
        """(3,) the largest variance that the noise of a block's mean may have."""
        return CHANCE * self.least


def learn(variation: VaneVariation, air: Array, follows: bool) -> None:
    """Take a block's air data (3,) without a fault; ``follows``: none is missing since the last."""
    if not follows:
        variation.last.clear()
    variation.last.append(air)
    if len(variation.last) == STRETCH + _ORDER:
        differences = np.diff(np.array(variation.last), _ORDER, axis=0)
        variation.least = np.minimum(variation.least, (differences**2).mean(axis=0) / _GAIN)
