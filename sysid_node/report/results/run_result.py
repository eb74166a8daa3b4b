"""The result of a run of an estimator, whichever command made it.

The report, ``summary.json`` and the CSV tables are written from this and nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.faults.recorded_flight import FaultVerdict
from sysid_node.online.types import Estimates
from sysid_node.report.results.signals import RunSignals


@dataclass(frozen=True)
class Prior:
    """The aircraft file's value of a derivative and its 1-sigma tolerance (NaN = not given)."""

    value: float
    tolerance: float = np.nan


#: Figures of merit on flights not used for the fit: flight -> output -> figure ("r_squared", "theil", ...) -> value.
Holdout = Mapping[str, Mapping[str, Mapping[str, float]]]


@dataclass(frozen=True)
class RunData:
    """How much data a run used, and what it left out."""

    seconds: float = np.nan
    samples: int = 0
    rejected: Mapping[str, int] = field(default_factory=dict)  # "<topic>: <reason>" -> messages left out


@dataclass(frozen=True)
class References:
    """What the estimates are compared with, by derivative."""

    prior: Mapping[str, Prior] = field(default_factory=dict)
    truth: Mapping[str, float] = field(default_factory=dict)  # where it is known (simulated flights)
    truth_since: Mapping[str, float] = field(default_factory=dict)  # s, of those that changed in flight


@dataclass(frozen=True)
class RunResult:
    """The results of ``sysid replay``, of ``sysid identify``, or of a live run.

    ``history`` holds the estimates over time in order, the last being the final one; a batch method gives just that
    one. Only ``aircraft``, ``method`` and ``history`` are needed: the report says what else is absent. ``history`` may
    be empty if nothing was estimated; ``data.rejected`` should then say why.
    Raises InputError where the times of ``history`` decrease.
    """

    aircraft: str  # its name
    method: str  # "sls_rft", "output_error", ...
    history: Sequence[Estimates]
    title: str = ""  # of the report; empty: made from the aircraft's name
    data: RunData = field(default_factory=RunData)
    settings: Mapping[str, object] = field(default_factory=dict)  # as written to summary.json
    references: References = field(default_factory=References)
    signals: RunSignals = field(default_factory=RunSignals)
    holdout: Holdout = field(default_factory=dict)
    faults: FaultVerdict | None = None  # None: no faults were looked for
    remarks: Sequence[str] = ()  # sentences: convergence, parameters that cannot be distinguished, warnings

    def __post_init__(self) -> None:
        times = [estimates.time for estimates in self.history]
        if any(later < earlier for earlier, later in pairwise(times)):
            raise InputError("estimates over time are out of order; give them by increasing time")

    @property
    def final(self) -> Estimates | None:
        """The last estimates, or None where there are none."""
        return self.history[-1] if self.history else None

    @property
    def heading(self) -> str:
        """The report's title."""
        return self.title or f"Aerodynamic derivatives of {self.aircraft}"


def prior_of(aircraft: Aircraft) -> dict[str, Prior]:
    """The aircraft file's derivatives as the report's prior."""
    return {
        name: Prior(derivative.value, np.nan if derivative.tolerance is None else derivative.tolerance)
        for name, derivative in aircraft.derivatives.items()
    }
