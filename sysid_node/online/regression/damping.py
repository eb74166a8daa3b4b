"""Moments whose damping comes out with the sign of a motion that amplifies itself.

The moment by a rate of rotation is opposed to it in every unstalled flight: Cl_p, Cm_q and Cn_r are negative (Etkin &
Reid, "Dynamics of Flight", 3rd ed. (1996), ch. 5). Of a rotation that follows its control after a time T, the servo's
time and that of the motion add up to T. Where the servo's time comes out larger than T, that of the motion is negative:
the motion then seems to come before its cause, and the derivatives by which it is told, those by the rate and by the
control among them, have the wrong sign. They look as precise as the right ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.regression.normal_equations import ModelStructure

Array = NDArray[np.float64]

#: The rate that damps a moment, and the control whose servo may take the motion's time.
DAMPING = {"Cl": ("p", "da"), "Cm": ("q", "de"), "Cn": ("r", "dr")}

CERTAIN = 2.0  # standard errors from zero beyond which a sign is no chance


def amplified(structure: ModelStructure, theta: Array, variance: Array) -> dict[int, str]:
    """Control by coefficient whose damping is surely positive, by estimates and their variances (P, C)."""
    found = {}
    for name, (rate, control) in DAMPING.items():
        if name not in structure.coefficients:
            continue
        c = structure.coefficients.index(name)
        own = {structure.regressors[i]: i for i in structure.unknowns(c).tolist()}
        if rate in own and control in own:
            value, at = theta[own[rate], c], (own[rate], c)
            if value > 0.0 and value * value > CERTAIN**2 * variance[at]:
                found[c] = control
    return found
