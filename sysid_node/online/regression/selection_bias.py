"""Correction of standard errors for selection bias, before they decide whether an estimate is valid.

While there are few data, some standard errors are small by chance. Small standard errors and large errors then occur
together, for two reasons: the instruments correlate with the regressors by chance, or the estimate lies by chance
towards that of least squares, which has the smallest residual. Selecting the estimates with small standard errors
would select these. Before a standard error is compared with the largest one allowed, it is therefore multiplied by two
factors. The first replaces the correlation found by the one that the aircraft file's model predicts
(``least_squares.instrument_strength``). The second replaces the residual by that of the mixed estimate of flight and
aircraft file (``mixed_estimation``). Both factors tend to one as data accumulate. The published interval is not
changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.regression.least_squares import InstrumentStrength, Solution, Uncertainty, residual_combinations
from sysid_node.online.regression.mixed_estimation import weighed
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]


def selection_bias_factors(
    equations: NormalEquations,
    solution: Solution,
    spread: Uncertainty,
    instrument_strength: InstrumentStrength,
    gram: Array,
    values: Array,
    precisions: Array,
) -> Array:
    """(P, C) factors of the squared standard errors, at least 1.

    ``values`` and ``precisions`` (P, C) are those of ``mixed_estimation.believed_derivatives``.
    """
    if equations.least_squares or not solution.usable:
        return np.ones_like(equations.structure.belongs)
    meeting, _ = weighed(equations.structure, solution.theta, spread.covariance, values, precisions)
    v = residual_combinations(equations, meeting)
    squares = ((gram @ v) * v).sum(axis=0)
    more = np.where(equations.instrumented, np.maximum(squares / np.maximum(solution.residual, 1e-300), 1.0), 1.0)
    factor = np.where(equations.instrumented, instrument_strength.selection_factor[:, None], 1.0) * more
    return np.asarray(factor * equations.structure.belongs)
