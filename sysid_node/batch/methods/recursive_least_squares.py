"""Recursive least squares: equation error sample by sample, with unfiltered signals.

Ljung & Soederstrom, "Theory and Practice of Recursive Identification" (1983), sec. 2.2; Klein & Morelli (2006), ch. 8.
After the last sample the estimates are those of least squares on all samples, so that noise on the regressors biases
them. The recursion's own covariance holds where the residual is white, which it hardly ever is; the standard errors are
those of ``sequential_fit`` instead. The method is here for comparison.
"""

from __future__ import annotations

from collections.abc import Sequence

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.sequential import recursive_estimate, sequential_fit
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.flight.record import Array, FlightRecord


def recursive_least_squares(aircraft: Aircraft, records: Sequence[FlightRecord], forgetting: float = 1.0) -> BatchFit:
    """The aircraft file's derivatives after one pass along all flights.

    ``forgetting`` is the weight that a sample keeps from one to the next. Raises InputError as ``equation_error`` does.
    """

    def estimator(_: Sequence[str], y: Array, X: Array, __: float) -> tuple[Array, Array]:
        return recursive_estimate(y, X, forgetting, lambda error: error)

    return sequential_fit("recursive_least_squares", aircraft, records, estimator)
