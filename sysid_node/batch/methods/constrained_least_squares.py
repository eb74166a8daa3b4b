"""Constrained least squares in short windows (modified sequential least squares).

Chandler, Pachter & Mears, "System Identification for Adaptive and Reconfigurable Control", JGCD 18(3), 1995; flown by
Ward, Monaco & Bodson, "Development and Flight Testing of a Parameter Identification Algorithm for Reconfigurable
Control", JGCD 21(6), 1998. Each window of data is least squares under two soft constraints: in time, the estimates stay
near those of the window before; in space, they stay near the aircraft file's within its tolerances. A window without
excitation therefore changes nothing, and a damage is followed within some windows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.regression.prior import tolerance_of
from sysid_node.batch.regression.sequential import sequential_fit
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.flight.record import Array, FlightRecord

WINDOW = 1.0  # s
#: Share of the information that the next window keeps: a memory of 20 windows.
FORGETTING = 0.95


def constrained_least_squares(
    aircraft: Aircraft, records: Sequence[FlightRecord], window: float = WINDOW, forgetting: float = FORGETTING
) -> BatchFit:
    """The aircraft file's derivatives after the last window of ``window`` s.

    ``forgetting`` is the share of the information kept from one window to the next. Raises InputError as
    ``equation_error`` does.
    """

    def estimator(names: Sequence[str], y: Array, X: Array, step: float) -> tuple[Array, Array]:
        prior = np.array([aircraft.derivatives[name].value for name in names])
        noise = max(float(np.std(y - X @ np.linalg.lstsq(X, y, rcond=None)[0])), 1e-12)
        weight = np.diag((noise / np.array([tolerance_of(aircraft, name) for name in names])) ** 2)
        windows = max(1, round(len(y) * step / window))
        return _windowed(np.array_split(y, windows), np.array_split(X, windows), prior, weight, forgetting)

    return sequential_fit("constrained_least_squares", aircraft, records, estimator, forgetting ** (1.0 / window))


def _windowed(
    ys: Sequence[Array], Xs: Sequence[Array], prior: Array, weight: Array, forgetting: float
) -> tuple[Array, Array]:
    """Values (p,) and covariance (p, p), for residuals of unit variance, after all windows.

    ``weight`` (p, p) is the information of the constraint in space, which in the long run counts once.
    """
    values, information = prior, weight
    for y, X in zip(ys, Xs, strict=True):
        moments = X.T @ y + forgetting * information @ values + (1.0 - forgetting) * weight @ prior
        information = X.T @ X + forgetting * information + (1.0 - forgetting) * weight
        values = np.asarray(np.linalg.solve(information, moments), dtype=np.float64)
    return values, np.asarray(np.linalg.inv(information))
