"""When a standard error may be called small.

Of many estimates that are hardly known yet, a few have small standard errors by chance, and those are off in one: where
chance correlates instruments with regressors, and where an estimate lies towards that of least squares, which leaves
the least residual. Whoever believes the estimates with small standard errors picks out just those. So before a standard
error is compared with what is allowed, it is made what it would be without such luck: with the correlation that the
aircraft file's model expects (``regression.hold``), and with the residual that is left where flight and file meet in
proportion to what they know (mixed estimation, see ``prior``). With more data both factors go to one. The published
interval is not changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.regression.least_squares import InstrumentStrength, Solution, Uncertainty, misfits
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
        return np.ones_like(equations.belongs)
    meeting, _ = weighed(equations, solution.theta, spread.covariance, values, precisions)
    v = misfits(equations, meeting)
    squares = ((gram @ v) * v).sum(axis=0)
    more = np.where(equations.instrumented, np.maximum(squares / np.maximum(solution.residual, 1e-300), 1.0), 1.0)
    return np.asarray(
        np.where(equations.instrumented, instrument_strength.selection_factor[:, None], 1.0) * more * equations.belongs
    )
