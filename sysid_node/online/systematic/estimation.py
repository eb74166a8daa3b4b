"""Systematic errors as they stand with the present solution, and the servos as the flight shows them."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.regression.information import Information
from sysid_node.online.regression.least_squares import TINY, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.systematic.consider import Beliefs, Considered, consider
from sysid_node.online.systematic.corrected_signals import CorrectedSignals, Known
from sysid_node.online.systematic.imperfections import Imperfections, prior
from sysid_node.online.systematic.servo_model import ServoModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

SURE = 2.0  # standard errors, and tolerances of the stamps, by which a servo must be ahead of its command to be refused
LARGEST_STEP = 0.05  # s by which a servo's lateness is changed at once
#: Sum of squares by which a step may worsen the fit: the estimates correct for noise, which that sum does not.
WORSE, WORSE_SHARE = 4.0, 0.1
SHORT = 0.3  # standard errors: a step within which the signals are linear enough
#: Share of its standard error, and time (s), by which a servo's lateness must change for the lines to be changed, too:
#: smaller changes are exact enough to second order. None is above ``NOTABLE_MOST`` s.
NOTABLE_SHARE, NOTABLE, NOTABLE_MOST = 0.5, 5e-4, 0.02
#: Tolerances about its expected value by which an imperfection is taken out of the signals at most: signals change in
#: proportion to small imperfections only.
LARGEST_CORRECTION = 6.0
EVERY = 4  # pieces between looks, once there are ``EARLY`` s of data
EARLY = 10.0


@dataclass(frozen=True)
class AlternativeSolution:
    """Another solution, which the data and what is believed hardly tell from the one that is taken."""

    imperfections: Array  # (K,) with the servos' coefficients themselves
    probability: float  # of it, at most a half

    @classmethod
    def of(cls, imperfect: Imperfections, found: SystematicErrors, probability: float) -> AlternativeSolution:
        """What was ``found`` from there."""
        return cls(found.considered.estimate + _base(imperfect, found.lines), probability)


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
    known: Known  # what one unit of each imperfection changes
    taken_out: Array  # (K,) of the imperfections, from the signals that it rests on
    limits: Array  # (m,) s: part of the lateness' tolerance by rate limits, which the flight cannot tell from a lag
    share: float = 1.0  # of the step that was made

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


@dataclass(frozen=True)
class CorrectedSolution:
    """The solution of all equations by the corrected signals, and how far it is to be trusted."""

    equations: NormalEquations
    solution: Solution
    spread: Uncertainty
    inflation: (
        Array  # (C,) factors of the statistical variances, which hold for what the flight tells of imperfections too
    )
    gusts: Array  # (C,) share of the residuals that is not the sensors' noise
    correction: Array  # (C, P + 1) by which the solution differs from that of the recorded signals
    noise_gram: Array | None  # (W, W) Gram matrix of the regressors' noise that it was freed of


def systematic_errors(
    imperfect: Imperfections,
    servos: ServoModel,
    solved: CorrectedSolution,
    signals: CorrectedSignals,
    pieces: int,
    share: float,
    alternatives: tuple[AlternativeSolution, ...],
) -> Generator[None, None, SystematicErrors]:
    """By the corrected ``signals`` and what is ``solved`` with them.

    The lines have the controls where the ``servos`` have them. At most a ``share`` of the step is made. The intervals
    reach to the ``alternatives``. It is made in steps (``state.Steps``).
    """
    equations, spread = solved.equations, solved.spread
    beliefs = Beliefs(*prior(imperfect, servos))
    noise = solved.inflation * noise_per_gram(equations, spread, signals.information)
    found = yield from consider(
        equations,
        solved.solution,
        noise,
        signals,
        imperfect.places,
        beliefs,
        spread.freedom,
        solved.gusts,
        solved.noise_gram,
    )
    share = min(share, LARGEST_STEP / max(float(np.abs(found.step[imperfect.servos]).max(initial=0.0)), LARGEST_STEP))
    found = found.shortened(share)
    for alternative in alternatives:
        found = found.widened(alternative.imperfections - _base(imperfect, servos), alternative.probability)
    published = with_steps(imperfect, found)
    return SystematicErrors(
        found,
        solved.correction + found.correction,
        published.variance(),
        published.slope_covariance(),
        _moved(imperfect, servos, found.estimate),
        np.sqrt(found.covariance.diagonal()[imperfect.servos]),
        servos,
        pieces,
        signals.information.energy,
        signals.known,
        signals.estimate,
        imperfect.limits,
        share,
    )


def _moved(imperfect: Imperfections, servos: ServoModel, estimate: Array) -> ServoModel:
    """The ``servos`` of all controls, moved by what is estimated of those that are not exactly known."""
    at, S, m = imperfect.timed, len(imperfect.sources), len(imperfect.controls)
    late, curved = np.zeros(servos.lateness.size), np.zeros(servos.lateness.size)
    late[at], curved[at] = estimate[S : S + m], estimate[S + m : S + 2 * m]
    return ServoModel(servos.lateness + late, servos.curvature + curved, servos.third)


def with_steps(imperfect: Imperfections, found: Considered) -> Considered:
    """With the time of steps: a flight shows the lateness of all of them, and a derivative may rest on a single one."""
    return found.with_error(imperfect.servos, imperfect.step_time) if imperfect.step_time else found


def _base(imperfect: Imperfections, servos: ServoModel) -> Array:
    """(K,) from where estimates of imperfections count: where the lines have the ``servos``; zero for all else."""
    at = imperfect.timed
    return np.concatenate(
        [np.zeros(len(imperfect.sources)), servos.lateness[at], servos.curvature[at], servos.third[at]]
    )


def worse(found: SystematicErrors, before: SystematicErrors) -> bool:
    """Whether the signals ``found`` rests on fit worse than those of ``before``, by whose noise both are weighed.

    After a short step they do not: more of what is not in the model has come with new data.
    """
    step, variance = before.considered.step, before.considered.covariance.diagonal()
    if (step * step <= SHORT**2 * variance).all():
        return False
    weights = before.considered.fit
    least = weights.cost(weights)
    return found.considered.fit.cost(weights) > least + WORSE + WORSE_SHARE * least


def to_take_out(imperfect: Imperfections, servos: ServoModel, last: SystematicErrors | None) -> Array:
    """(K,) the imperfections as last estimated, beyond where the lines have the ``servos`` by now."""
    at, S, m = imperfect.timed, len(imperfect.sources), len(imperfect.controls)
    if last is None:
        return np.array([*(source.stated for source in imperfect.sources), *np.zeros(3 * m)])
    late, curved = last.servos.lateness[at] - servos.lateness[at], last.servos.curvature[at] - servos.curvature[at]
    third = last.lines.third[at] - servos.third[at] + last.considered.estimate[S + 2 * m :]
    sigmas, expected = (each[:S] for each in prior(imperfect, servos)[:2])
    most = LARGEST_CORRECTION * sigmas
    sources = np.clip(last.considered.estimate[:S], expected - most, expected + most)
    return np.concatenate([sources, late, curved, third])


def noise_per_gram(equations: NormalEquations, spread: Uncertainty, total: Information) -> Array:
    """(C,) variance of a score over the energy of its instrument, in the mean over a coefficient's unknowns."""
    V = equations.instruments
    energies = total.grams.sum(axis=0).diagonal()[V]
    scores = spread.bands @ total.scores.diagonal(axis1=1, axis2=2)[:, V]  # (C, P)
    shares = scores / np.maximum(energies, TINY) * equations.structure.belongs.T
    return np.asarray(shares.sum(axis=1) / equations.structure.belongs.sum(axis=0))


def notable_step(imperfect: Imperfections, servos: ServoModel, found: SystematicErrors) -> ServoModel | None:
    """Where the lines should have the servos from now on; None where they are near enough there."""
    at = imperfect.timed
    step = found.servos.lateness - servos.lateness
    if not (np.abs(step[at]) > np.minimum(NOTABLE_SHARE * found.errors + NOTABLE, NOTABLE_MOST)).any():
        return None
    return servos.moved(step, found.servos.curvature - servos.curvature)
