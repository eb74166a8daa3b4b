"""Recursive least squares on the filtered error: error-filtering on-line learning.

Farrell & Polycarpou, "Adaptive Approximation Based Control" (2006), sec. 4.3: the prediction error passes a first-order
filter before it corrects the estimates, e_f' = rate (e - e_f). For a moment, whose error holds the derivative of a
measured rate, the filtered error needs no differentiation: it is the error of an observer of the rate, and the noise of
differentiation never enters. Regressors are not filtered: what noise on them biases stays biased.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.sequential import recursion, sequential_fit
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.flight.record import Array, FlightRecord

#: rad/s: bandwidth of the filter; well above the short period of a small aircraft.
DEFAULT_RATE = 30.0


def error_filtering(aircraft: Aircraft, records: Sequence[FlightRecord], rate: float = DEFAULT_RATE) -> BatchFit:
    """The aircraft file's derivatives after one pass; ``rate`` rad/s. Raises InputError as ``equation_error`` does."""

    def along(_: Sequence[str], y: Array, X: Array, step: float) -> tuple[Array, Array]:
        return recursion(y, X, 1.0, _first_order(math.exp(-rate * step)))

    return sequential_fit("error_filtering", aircraft, records, along)


def _first_order(kept: float) -> Callable[[float], float]:
    """A first-order low-pass, fed one error after the other."""
    state = 0.0

    def filtered(error: float) -> float:
        nonlocal state
        state = kept * state + (1.0 - kept) * error
        return state

    return filtered
