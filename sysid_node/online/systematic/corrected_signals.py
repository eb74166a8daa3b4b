"""The signals of a flight with what is estimated of the imperfections taken out.

An imperfection changes a signal by sums of other signals and of their rates (``column_changes``), so that signals
corrected for the estimates kappa are M [x, dx/dt], with M = [1 + sum kappa_k A_k, sum kappa_k B_k]. Their Gram matrices
follow from those of signals and rates. The derivatives are solved for anew with these: it is the Gauss-Newton method
on imperfections and derivatives together, of which correcting the derivatives by their sensitivities would be the first
step alone. An air-data lag of 60 ms, say, turns and weakens what a short-period motion shows of the flow by so much
that a first-order correction attributes the rest of it to a late rudder.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout
from sysid_node.online.regression.information import Information, Spectrum, with_grams
from sysid_node.online.regression.instruments import InstrumentModel
from sysid_node.online.regression.least_squares import Solution
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic import cross_spectra, servo_model
from sysid_node.online.systematic.column_changes import ColumnChanges
from sysid_node.online.systematic.imperfections import Imperfections, column_changes
from sysid_node.online.systematic.servo_model import ServoModel

Array = NDArray[np.float64]

GROWTH = 1.3  # of the data, after which the flight's means are taken anew

#: Seconds of data that column changes rest on, and the changes themselves.
Known = tuple[float, ColumnChanges]


@dataclass(frozen=True)
class CorrectedSignals:
    """N signals (``ServoColumns``), of which W make the regression, corrected for K imperfections."""

    estimate: Array  # (K,) what is taken out
    known: Known
    gram: Array  # (2N, 2N) of the signals as they were recorded and of their rates
    matrix: Array  # (N, 2N) that makes the corrected signals of them
    means: Array  # (W,) of the signals as they were recorded
    corrected_means: Array  # (W,)
    information: Information  # with the corrected signals

    @property
    def changes(self) -> ColumnChanges:
        """What one unit of each imperfection changes."""
        return self.known[1]

    def offsets(self, equations: NormalEquations, solution: Solution) -> Array:
        """(C,) C_0 by the corrected means."""
        return _offsets(equations, solution, self.corrected_means)

    def correction(self, equations: NormalEquations, corrected: Solution, recorded: Solution) -> Array:
        """(C, P + 1) the solution with corrected signals less that with recorded ones: slopes, and offsets."""
        slopes = (corrected.theta - recorded.theta).T
        offsets = self.offsets(equations, corrected) - _offsets(equations, recorded, self.means)
        return np.column_stack([slopes, offsets])


def _offsets(equations: NormalEquations, solution: Solution, means: Array) -> Array:
    """(C,) mean of the coefficient - sum of C_j times the mean of x_j."""
    return np.asarray(means[equations.outputs] - means[equations.columns] @ solution.theta)


def known_changes(
    imperfect: Imperfections, aircraft: Aircraft, layout: SignalLayout, total: Information, last: Known | None
) -> Known:
    """What one unit of each imperfection changes: the ``last`` known, or by new means where data have grown by much."""
    if last is not None and last[0] <= total.energy <= GROWTH * last[0]:
        return last
    return total.energy, column_changes(imperfect, aircraft, layout, total.integrals)


def corrected_signals(
    imperfect: Imperfections,
    lines: Spectrum,
    model: InstrumentModel | None,
    servos: ServoModel,
    total: Information,
    estimate: Array,
    known: Known,
) -> Generator[None, None, CorrectedSignals]:
    """From the information ``total``, whose lines have the controls where these ``servos`` have them.

    ``model`` is that of the instruments, ``estimate`` (K,) what is to be taken out, ``known`` from ``known_changes``.
    It is made in two steps (``state.Steps``).
    """
    changes, layout = known[1], known[1].layout
    model = model or InstrumentModel(np.zeros((lines.omega.size, 0, 0), complex), layout.deflections, layout.rates)
    spectra = cross_spectra.with_servos(
        total.spectra, imperfect.columns, model, lines.omega, servo_model.rate_gain(servos, lines.omega)
    )
    yield
    moments = cross_spectra.band_moments(spectra, lines.omega, lines.bands)
    matrix = corrected_by(changes, estimate)
    means = total.integrals / max(float(total.integrals[OFFSET]), 1e-12)
    of_regression = matrix[imperfect.places]
    grams = of_regression @ moments @ of_regression.T
    return CorrectedSignals(
        estimate,
        known,
        moments.sum(axis=0),
        matrix,
        means,
        means + estimate @ changes.shifts[:, imperfect.places],
        with_grams(total, grams),
    )


def corrected_by(changes: ColumnChanges, estimate: Array) -> Array:
    """(N, 2N) that makes the signals without the ``estimate`` (K,) of signals and rates: exp of their change.

    It is of second order: a scale and a lag, say, multiply. Only second derivatives are left out.
    """
    change, rates = np.tensordot(estimate, changes.signals, axes=1), changes.rates
    N = len(change)
    kept = rates < N
    own = change[:, :N].copy()
    own[:, rates[kept]] = 0.0
    both = change.copy()
    both[np.ix_(rates[kept], rates)] += own[kept]  # a rate changes as its signal does
    return np.asarray(np.eye(N, 2 * N) + change + 0.5 * (both[:, :N] @ both))
