"""The terms of the reference model: each derivative of the aircraft file, and an offset of each coefficient.

In addition, each control has a term for each lag of its servo (see ``lagged_controls``), which enters all coefficients
in proportion to the control's derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.model.lagged_controls import LAGS
from sysid_node.online.frequency import regression_signals
from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout

Array = NDArray[np.float64]

#: Plausible sizes of regressors in flight: rad, and non-dimensional rates.
_SIGNALS = {"alpha": 0.05, "beta": 0.05, "p": 0.04, "q": 0.01, "r": 0.02}
_SURFACE = 0.05  # rad
_LOOSE = (0.5, 0.05)  # tolerance of a derivative without one: share of its value, and least value
_OFFSET = 0.01  # tolerance of an offset that is not in the file

RATES = ("p", "q", "r")
_ALL = -1  # in place of the coefficient of a term that enters all of them


@dataclass(frozen=True)
class Terms:
    """D terms of C = 6 coefficients."""

    names: tuple[str, ...]
    output: NDArray[np.intp]  # (D,) place of the coefficient; negative for the terms of servos
    column: NDArray[np.intp]  # (D,) of the layout; of a block's ``behind`` for the terms of servos
    #: By control: the terms of its servo, one for each lag, and the control's derivatives.
    servos: Mapping[str, tuple[NDArray[np.intp], NDArray[np.intp]]]
    values: Array  # (D,) the file's
    tolerance: Array  # (D,) 1 sigma
    signal: Array  # (D,) plausible size of the regressor

    @cached_property
    def regressors(self) -> tuple[str, ...]:
        """(D,) the regressor of each term."""
        return tuple(name.partition("_")[2] for name in self.names)

    @cached_property
    def coefficients(self) -> tuple[int, ...]:
        """The coefficients whose equations are formed."""
        return tuple(sorted({output for output in self.output.tolist() if output != _ALL}))

    @cached_property
    def derivatives(self) -> NDArray[np.intp]:
        """The terms that are derivatives or offsets, which come first."""
        return np.flatnonzero(self.output != _ALL)

    def of(self, regressor: str) -> NDArray[np.bool_]:
        """(D,) which terms have this regressor."""
        return np.array([name == regressor for name in self.regressors])

    def offset_of(self, output: int) -> int:
        """The term that is the offset of a coefficient."""
        return int(np.flatnonzero((self.output == output) & (self.column == OFFSET))[0])


def terms(aircraft: Aircraft, layout: SignalLayout) -> Terms:
    """The terms of the coefficients whose equations can be formed."""
    unformed = regression_signals.unformed(aircraft)
    known = {c: regressors for c, regressors in aircraft.model_structure.items() if c not in unformed}
    names = [f"{c}_{r}" for c, regressors in known.items() for r in dict.fromkeys((*regressors, "0"))]
    rows = []
    for name in names:
        c, _, r = name.partition("_")
        derivative = aircraft.derivatives.get(name)
        value = derivative.value if derivative else 0.0
        loose = max(_LOOSE[0] * abs(value), _LOOSE[1]) if r != "0" else _OFFSET
        tolerance = (derivative.tolerance if derivative else None) or loose
        signal = 1.0 if r == "0" else _SIGNALS.get(r, _SURFACE)
        rows.append((COEFFICIENTS.index(c), layout.column(r), value, tolerance, signal))
    lags = [f"servo_{name}_{lag}" for name in aircraft.controls for lag in LAGS]
    rows += [(_ALL, column, 0.0, 0.0, 0.0) for column, _ in enumerate(lags)]
    output, column, *numbers = (np.array(x) for x in zip(*rows, strict=True))
    places = np.arange(len(names), len(rows)).reshape(len(aircraft.controls), len(LAGS))
    servos = {
        name: (places[i], np.flatnonzero([one.endswith(f"_{control.symbol}") for one in names]))
        for i, (name, control) in enumerate(aircraft.controls.items())
    }
    return Terms((*names, *lags), output, column, servos, *numbers)


def design_of(terms: Terms, values: Array, regressors: Array, behind: Array) -> Array:
    """(6, D) the regressors of a block by coefficient and term; those of servos for derivatives ``values`` (D,)."""
    found = np.zeros((len(COEFFICIENTS), len(terms.names)))
    plain = terms.derivatives
    found[terms.output[plain], plain] = regressors[terms.column[plain]]
    for servo, derivatives in terms.servos.values():
        found[terms.output[derivatives][:, None], servo] = values[derivatives][:, None] * behind[terms.column[servo]]
    return found
