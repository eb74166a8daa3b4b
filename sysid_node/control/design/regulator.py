"""Gains for a linear model by the linear quadratic regulator, and the choice of its weight on the surfaces.

Stevens, Lewis & Johnson (2016), sect. 5.3 and 5.4: attitude errors and their integrals, weights by Bryson's rule.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are

from sysid_node.control.design.margins import margins
from sysid_node.dynamics.linear_model import LinearModel
from sysid_node.errors import InputError

Array = NDArray[np.float64]

#: Margins of the baseline: 12 dB and 60 deg, more than the 6 dB and 45 deg that adapted gains must have.
GAIN_MARGIN, PHASE_MARGIN = 10.0 ** (12.0 / 20.0), np.deg2rad(60.0)
_WEIGHTS = np.logspace(-3.0, 6.0, 91)  # that are tried on the surfaces


def gains(plant: LinearModel, Q: Array, R: Array) -> Array:
    """K (m, n) of u = -K x that minimises the integral of x'Qx + u'Ru.

    Q (n,) is a diagonal. Raises LinAlgError without a solution.
    """
    try:
        P = solve_continuous_are(plant.A, plant.B, np.diag(Q), R)
    except ValueError as error:  # not finite
        raise np.linalg.LinAlgError(str(error)) from None
    return np.asarray(np.linalg.solve(R, plant.B.T @ P))


def least_weight(plant: LinearModel, Q: Array, delay: float) -> float:
    """The least weight on the squared deflections that gives the baseline's margins.

    Raises InputError where none does.
    """
    eye = np.eye(plant.B.shape[-1])
    for weight in _WEIGHTS.tolist():
        found = margins(plant, gains(plant, Q, weight * eye), delay)
        if bool(found.enough(GAIN_MARGIN, PHASE_MARGIN)):
            return float(weight)
    raise InputError(
        f"no gains leave 12 dB and 60 deg with a delay of {delay:g} s: the aircraft of the file is not stable enough, "
        "or its actuators are too slow"
    )
