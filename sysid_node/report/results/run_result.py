"""RunResult: all that a run of an estimator leaves behind, whichever command made it.

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
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.online.types import Estimates


@dataclass(frozen=True)
class Prior:
    """What the aircraft file says of a derivative: its value and 1-sigma tolerance (NaN = not given)."""

    value: float
    tolerance: float = np.nan


@dataclass(frozen=True)
class Spectra:
    """Amplitude spectra on one frequency axis: peak amplitude of a sinusoid at each frequency.

    ``frequency`` (F,) Hz, increasing; ``inputs`` control symbol -> (F,) in rad (thrust in N);
    ``measured`` and ``residuals`` coefficient -> (F,), non-dimensional: as measured, and measured minus modelled.
    """

    frequency: Array
    inputs: Mapping[str, Array] = field(default_factory=dict)
    measured: Mapping[str, Array] = field(default_factory=dict)
    residuals: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, values in (*self.inputs.items(), *self.measured.items(), *self.residuals.items()):
            if values.shape != self.frequency.shape:
                raise InputError(
                    f"spectrum {name!r} has {values.size} values for {self.frequency.size} frequencies; "
                    "give every spectrum on the same frequencies"
                )


@dataclass(frozen=True)
class Response:
    """A measured quantity and the model's answer to the same inputs: ``time`` (N,) s, both (N,) in ``unit``."""

    unit: str  # "" = non-dimensional
    time: Array
    measured: Array
    modelled: Array

    def __post_init__(self) -> None:
        if not self.time.shape == self.measured.shape == self.modelled.shape:
            raise InputError(
                f"response: {self.time.size} times, {self.measured.size} measured and {self.modelled.size} "
                "modelled values; the three must be equally long"
            )


#: Figures of merit on flights not used for the fit: flight -> output -> figure ("r_squared", "theil", ...) -> value.
Holdout = Mapping[str, Mapping[str, Mapping[str, float]]]


@dataclass(frozen=True)
class RunResult:
    """The results of ``sysid replay``, of ``sysid identify``, or of a live run.

    ``history`` holds the estimates over time in order, the last being the final one: a batch method gives
    just that one. Only ``aircraft``, ``method`` and ``history`` are needed; the report leaves out what is
    not there and says so. ``history`` may be empty: nothing was estimated, and ``rejected`` should say why.
    Raises InputError where the times of ``history`` decrease.
    """

    aircraft: str  # its name
    method: str  # "sls_rft", "output_error", ...
    history: Sequence[Estimates]
    title: str = ""  # of the report; empty: made from the aircraft's name
    data_seconds: float = np.nan
    samples: int = 0
    settings: Mapping[str, object] = field(default_factory=dict)  # as written to summary.json
    prior: Mapping[str, Prior] = field(default_factory=dict)  # by derivative
    truth: Mapping[str, float] = field(default_factory=dict)  # by derivative, where it is known (simulated flights)
    truth_since: Mapping[str, float] = field(default_factory=dict)  # s, of those that changed in flight
    flight: FlightRecord | None = None  # the aligned samples, for the drawn time histories
    spectra: Spectra | None = None
    responses: Mapping[str, Response] = field(default_factory=dict)  # by output or coefficient
    response_note: str = ""  # a sentence: how the responses were made, e.g. averaged
    rejected: Mapping[str, int] = field(default_factory=dict)  # "<topic>: <reason>" -> messages left out
    holdout: Holdout = field(default_factory=dict)
    faults: FaultVerdict | None = None  # None: nothing was judged
    remarks: Sequence[str] = ()  # sentences: convergence, parameters that cannot be told apart, warnings

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
