"""Modified sequential least squares: short windows, held in place by what was known before.

Chandler, Pachter & Mears, "System Identification for Adaptive and Reconfigurable Control", JGCD 18(3), 1995; flown by
Ward, Monaco & Bodson, "Development and Flight Testing of a Parameter Identification Algorithm for Reconfigurable
Control", JGCD 21(6), 1998. Each window of data is least squares under two soft constraints: in time, that the estimates
move little from the window before; in space, that they stay near the aircraft file's within its tolerances. So a window
without excitation changes nothing, and a damage is followed within some windows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.sequential import sequential_fit
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.flight.record import Array, FlightRecord

WINDOW = 1.0  # s
#: Share of what is known that the next window keeps: a memory of 20 windows.
KEPT = 0.95

#: Of a derivative without a tolerance in the aircraft file: this share of its value, or this much.
_LOOSE = (0.5, 0.05)


def constrained_least_squares(
    aircraft: Aircraft, records: Sequence[FlightRecord], window: float = WINDOW, kept: float = KEPT
) -> BatchFit:
    """The aircraft file's derivatives after the last window. Raises InputError as ``equation_error`` does."""

    def along(names: Sequence[str], y: Array, X: Array, step: float) -> tuple[Array, Array]:
        prior = np.array([aircraft.derivatives[name].value for name in names])
        noise = max(float(np.std(y - X @ np.linalg.lstsq(X, y, rcond=None)[0])), 1e-12)
        weight = np.diag((noise / np.array([_tolerance(aircraft, name) for name in names])) ** 2)
        pieces = max(1, round(len(y) * step / window))
        return _windows(np.array_split(y, pieces), np.array_split(X, pieces), prior, weight, kept)

    return sequential_fit("constrained_least_squares", aircraft, records, along)


def _tolerance(aircraft: Aircraft, name: str) -> float:
    derivative = aircraft.derivatives[name]
    return derivative.tolerance or max(_LOOSE[0] * abs(derivative.value), _LOOSE[1])


def _windows(ys: Sequence[Array], Xs: Sequence[Array], prior: Array, weight: Array, kept: float) -> tuple[Array, Array]:
    """Values and covariance for a residual's variance of one, after all windows.

    ``weight`` (p, p) is the information in the constraint in space; in the long run it counts once.
    """
    values, information = prior, weight
    for y, X in zip(ys, Xs, strict=True):
        moments = X.T @ y + kept * information @ values + (1.0 - kept) * weight @ prior
        information = X.T @ X + kept * information + (1.0 - kept) * weight
        values = np.asarray(np.linalg.solve(information, moments), dtype=np.float64)
    return values, np.asarray(np.linalg.inv(information))
