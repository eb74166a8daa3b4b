"""Test for a lag between measured deflections and their effect, and for the bias that it causes.

Most small aircraft record commands instead of positions, and the surfaces follow late. A lag tau turns C_delta delta
into C_delta (delta - tau d delta / dt), to first order, and biases all derivatives of the equation,
most of all the damping, while the residual hardly shows it. So each equation is solved a second time with the
control's rate as a further regressor: its coefficient is -C_delta tau (the same device finds time skews in Jategaonkar,
"Flight Vehicle System Identification", 2nd ed., 2015, sec. 10.5). An estimate that this moves by more than its interval
allows is not valid.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression.least_squares import Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]

SIGNIFICANT = 4.0  # standard errors by which a lag must differ from none
SHIFT_STANDARD_ERRORS = 1.5  # standard errors that an estimate may move when the lag is allowed for
NEGLIGIBLE_SHARE = 0.02  # share of its size that an estimate may move in any case


class Lag(NamedTuple):
    """How late a control's deflections are felt, s; negative where they are felt before they are measured."""

    control: str  # symbol
    delay: float
    standard_error: float


class LagTest(NamedTuple):
    """The most precise lag of each control, and the estimates that a lag biases."""

    lags: tuple[Lag, ...]
    biased: NDArray[np.bool_]  # (P, C)
    lagging_control: dict[int, str]  # coefficient -> control


def examine(
    equations: NormalEquations,
    layout: SignalLayout,
    solution: Solution,
    spread: Uncertainty,
    gram: Array,
    systematic: Array | None = None,
) -> LagTest:
    """Solve every equation again with the rate of each of its controls; ``gram`` (W, W) is that of ``solution``.

    ``systematic`` (C, P) are the variances of the slopes by what is taken as known: the interval holds them, too.
    """
    structure = equations.structure
    biased = np.zeros(structure.belongs.shape, dtype=bool)
    lagging_control: dict[int, str] = {}
    best: dict[str, Lag] = {}
    for c in np.flatnonzero(spread.density > 0.0).tolist():
        unknowns = structure.unknowns(c)
        variance = spread.covariance[c].diagonal()[unknowns]
        if systematic is not None:
            variance = variance + systematic[c, unknowns]
        errors = np.sqrt(np.maximum(variance, 0.0))
        for symbol in layout.timed:
            places = [k for k, i in enumerate(unknowns.tolist()) if structure.regressors[i] == symbol]
            if not places:
                continue
            lag, moved = _with_rate(equations, layout, solution, spread, gram, c, symbol, places[0])
            if lag is None:
                continue
            if symbol not in best or lag.standard_error < best[symbol].standard_error:
                best[symbol] = lag
            size = np.abs(solution.theta[unknowns, c])
            bad = (moved > SHIFT_STANDARD_ERRORS * errors) & (moved > NEGLIGIBLE_SHARE * size)
            if abs(lag.delay) > SIGNIFICANT * lag.standard_error and bad.any():
                biased[unknowns[bad], c] = True
                lagging_control[c] = symbol
    return LagTest(tuple(best.values()), biased, lagging_control)


def _with_rate(
    equations: NormalEquations,
    layout: SignalLayout,
    solution: Solution,
    spread: Uncertainty,
    gram: Array,
    c: int,
    symbol: str,
    place: int,
) -> tuple[Lag | None, Array]:
    """The control's lag by one coefficient's equation, and how far (p,) its estimates move when it is allowed for."""
    unknowns = equations.structure.unknowns(c)
    J, rate = equations.columns[unknowns], layout.column(f"{symbol} rate")
    block = solution.inverse[np.ix_(unknowns, unknowns)]
    v = np.zeros(equations.width)
    v[equations.outputs[c]], v[J] = 1.0, -solution.theta[unknowns, c]
    # one regressor more, by the partitioned inverse
    share = block @ gram[equations.instruments[unknowns], rate]
    left = float(gram[rate, rate] - gram[rate, J] @ share)
    effect = float(solution.theta[unknowns[place], c])
    if left <= 1e-6 * float(gram[rate, rate]) or effect == 0.0:
        return None, np.zeros(unknowns.size)
    slope = float(gram[rate] @ v) / left
    variance = np.maximum(spread.covariance[c].diagonal()[unknowns], 0.0)
    colour = float(np.max(variance / np.maximum(np.abs(block.diagonal()), 1e-300)))
    return Lag(symbol, -slope / effect, math.sqrt(colour / left) / abs(effect)), np.abs(share * slope)
