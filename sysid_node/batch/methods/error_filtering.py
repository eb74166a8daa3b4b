"""Recursive least squares on the filtered prediction error (error-filtering on-line learning).

Farrell & Polycarpou, "Adaptive Approximation Based Control" (2006), sec. 4.3. The prediction error passes a first-order
filter before it corrects the estimates, e_f' = rate (e - e_f). The error of a moment contains the derivative of a
measured rate. Its filtered error is the error of an observer of that rate, which needs no differentiation and so has
none of its noise. The regressors are not filtered: noise on them biases the estimates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.sequential import recursive_estimate, sequential_fit
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.flight.record import Array, FlightRecord

#: rad/s: bandwidth of the filter; well above the short period of a small aircraft.
DEFAULT_RATE = 30.0


def error_filtering(aircraft: Aircraft, records: Sequence[FlightRecord], rate: float = DEFAULT_RATE) -> BatchFit:
    """The aircraft file's derivatives after one pass; ``rate`` rad/s. Raises InputError as ``equation_error`` does."""

    def estimator(_: Sequence[str], y: Array, X: Array, step: float) -> tuple[Array, Array]:
        return recursive_estimate(y, X, 1.0, _first_order_filter(math.exp(-rate * step)))

    return sequential_fit("error_filtering", aircraft, records, estimator)


def _first_order_filter(pole: float) -> Callable[[float], float]:
    """A first-order low-pass filter with this discrete pole, called with one value after the other."""
    state = 0.0

    def filtered(value: float) -> float:
        nonlocal state
        state = pole * state + (1.0 - pole) * value
        return state

    return filtered
