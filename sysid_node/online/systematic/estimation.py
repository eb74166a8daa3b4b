"""Systematic errors as they stand with the present solution, and the servos as the flight shows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression.information import Information, Spectrum
from sysid_node.online.regression.instruments import InstrumentModel
from sysid_node.online.regression.least_squares import TINY, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic import cross_spectra, servo_model
from sysid_node.online.systematic.column_changes import ColumnChanges
from sysid_node.online.systematic.consider import Considered, consider
from sysid_node.online.systematic.imperfections import Imperfections, column_changes, prior
from sysid_node.online.systematic.servo_model import ServoModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

SURE = 2.0  # standard errors, and tolerances of the stamps, by which a servo must be ahead of its command to be refused
LARGEST_STEP = 0.05  # s by which a servo's lateness is changed at once
#: Share of its standard error, and time (s), by which a servo's lateness must change for the lines to be changed, too:
#: smaller changes are exact enough to first order.
NOTABLE_SHARE, NOTABLE = 0.5, 5e-4
EVERY = 4  # pieces between looks, once there are ``EARLY`` s of data
EARLY = 10.0
GROWTH = 1.3  # of the data, after which the flight's means are taken anew


@dataclass(frozen=True)
class SystematicErrors:
    """Of C coefficients' P slopes and, behind them, offsets."""

    considered: Considered
    correction: Array  # (C, P + 1) to be added to the estimates
    variance: Array  # (C, P + 1)
    covariance: Array  # (C, P, P) of the slopes
    servos: ServoModel  # of all controls, as the correction has them
    errors: Array  # (m,) standard errors of the lateness of those that are not exactly known, s
    lines: ServoModel  # as the lines had them
    pieces: int  # number of pieces finished when this was found
    energy: float  # s: data that it rests on
    changes: tuple[float, ColumnChanges, Array]  # s: data that the column changes rest on; them; the signals' means

    def ahead(self, imperfect: Imperfections) -> Flags:
        """(m,) the servos that would surely move their surfaces before the commands.

        No servo does: gusts or another error are taken for it.
        """
        late = self.servos.lateness[imperfect.timed]
        return np.asarray(late + SURE * self.errors < -SURE * imperfect.stamps)

    def holds(self, pieces: int, servos: ServoModel, energy: float) -> bool:
        """Whether this is new enough: it changes slowly once there are data."""
        new = pieces - self.pieces < (EVERY if self.energy > EARLY else 1)
        return new and self.lines is servos and energy >= self.energy


def systematic_errors(
    imperfect: Imperfections,
    aircraft: Aircraft,
    layout: SignalLayout,
    lines: Spectrum,
    model: InstrumentModel | None,
    servos: ServoModel,
    equations: NormalEquations,
    solution: Solution,
    spread: Uncertainty,
    total: Information,
    inflation: Array,
    pieces: int,
    known: tuple[float, ColumnChanges, Array] | None,
) -> SystematicErrors:
    """By the information ``total``, whose lines have the controls where these ``servos`` have them.

    ``model`` is that of the instruments.

    ``inflation`` (C,): factors of the statistical variances, which hold for what the flight tells of imperfections too.
    ``known`` are the changes that were last used; they depend on the flight's means alone.
    """
    model = model or InstrumentModel(np.zeros((lines.omega.size, 0, 0), complex), layout.deflections, layout.rates)
    spectra = cross_spectra.with_servos(
        total.spectra, imperfect.columns, model, lines.omega, servo_model.rate_gain(servos, lines.omega)
    )
    gram = cross_spectra.moments(spectra, lines.omega)
    if known is None or not known[0] <= total.energy <= GROWTH * known[0]:
        known = (total.energy, *column_changes(imperfect, aircraft, layout, total.integrals))
    _, changes, means = known
    sigmas, centre = prior(imperfect, servos)
    noise = inflation * noise_per_gram(equations, spread, total)
    found = consider(equations, solution, noise, gram, changes, sigmas, centre, means, spread.freedom)
    at, S, m = imperfect.timed, len(imperfect.sources), len(imperfect.controls)
    late, curved = np.zeros(servos.lateness.size), np.zeros(servos.lateness.size)
    late[at], curved[at] = found.estimate[S : S + m], found.estimate[S + m :]
    errors = np.sqrt(found.covariance.diagonal()[S : S + m])
    return SystematicErrors(
        found,
        found.correction,
        found.variance(),
        found.slope_covariance(),
        ServoModel(servos.lateness + late, servos.curvature + curved),
        errors,
        servos,
        pieces,
        total.energy,
        known,
    )


def noise_per_gram(equations: NormalEquations, spread: Uncertainty, total: Information) -> Array:
    """(C,) variance of a score over the energy of its instrument, in the mean over a coefficient's unknowns."""
    V = equations.instruments
    energies = total.grams.sum(axis=0).diagonal()[V]
    scores = spread.bands @ total.scores.diagonal(axis1=1, axis2=2)[:, V]  # (C, P)
    shares = scores / np.maximum(energies, TINY) * equations.belongs.T
    return np.asarray(shares.sum(axis=1) / equations.belongs.sum(axis=0))


def notable_step(imperfect: Imperfections, servos: ServoModel, found: SystematicErrors) -> ServoModel | None:
    """Where the lines should have the servos from now on; None where they are near enough there."""
    at = imperfect.timed
    step = found.servos.lateness - servos.lateness
    if not (np.abs(step[at]) > NOTABLE_SHARE * found.errors + NOTABLE).any():
        return None
    share = min(1.0, LARGEST_STEP / max(float(np.abs(step).max()), TINY))
    return servos.moved(share * step, share * (found.servos.curvature - servos.curvature))
