"""Which effects are accepted: what predicts better beyond doubt, and closes a share of the gap that matters.

Significant is not enough: a clock's odd millisecond is real, and trifling.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, with_candidates
from sysid_node.gap.estimation.candidates import TIME_EFFECTS
from sysid_node.gap.estimation.predictive_density import Evidence, probabilities
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.instruments.bayes_factor import log_bayes_factor
from sysid_node.gap.instruments.overidentification import overidentification_of
from sysid_node.gap.residuals.air_motion import is_gusty
from sysid_node.gap.residuals.residual_model import CHANNELS, COEFFICIENTS
from sysid_node.gap.residuals.windowed_spectra import power_of
from sysid_node.gap.selection.candidate_fitter import FittedSet
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import EFFECTS


def likelier(trial: FittedSet, other: FittedSet) -> bool:
    """Whether a trial predicts better than another, beyond doubt."""
    return bool(probabilities([trial.evidence.scores, other.evidence.scores])[0] > THRESHOLDS.acceptance.probability)


def accepted(base: FittedSet, without: FittedSet, trial: FittedSet) -> bool:
    """Whether a trial predicts better than what it was tried upon, beyond doubt, and by enough to matter.

    Also of what the commands foretell, having been picked from so many: gusts can fake the rest, and where the model is
    not exact every manoeuvre repeats the last one's error.
    """
    if _trifling(trial) or not likelier(trial, without):
        return False
    matters = _matters_in_gusts(without, trial) if _in_gusts(trial) else _matters(without, trial)
    if not np.any(matters & (_contributed(base, without, trial) > THRESHOLDS.acceptance.share_of_gap)):
        return False
    return log_bayes_factor(trial.fit, without.fit) > THRESHOLDS.acceptance.log_bayes_factor(len(EFFECTS))


def _matters(without: FittedSet, trial: FittedSet) -> NDArray[np.bool_]:
    """Channels (12,) on which a trial takes enough of the remainder away."""
    left, motion = power_left(without.evidence), _motion(trial)
    gone = left - power_left(trial.evidence)
    return np.asarray(
        (
            (gone > THRESHOLDS.acceptance.share_of_remainder * left)
            & (gone > THRESHOLDS.acceptance.noticeable_error**2 * motion)
        )
        | (gone > THRESHOLDS.acceptance.large_error**2 * motion)
    )


def _matters_in_gusts(without: FittedSet, trial: FittedSet) -> NDArray[np.bool_]:
    """The same, of forces and moments by what of the remainder is structure: the rest is weather."""
    before, after = overidentification_of(without.fit, trial.fit.powers), overidentification_of(trial.fit)
    scale = power_left(without.evidence) / np.maximum(before.total, 1e-300)
    gone = before.coherent - after.coherent
    structured = (gone > THRESHOLDS.acceptance.share_of_remainder * before.coherent) & (
        gone * scale > THRESHOLDS.acceptance.noticeable_error**2 * _motion(trial)
    )
    forces = np.arange(len(CHANNELS)) < len(COEFFICIENTS)
    return np.where(forces, structured | _shifts(without, trial), _matters(without, trial))


def _shifts(without: FittedSet, trial: FittedSet) -> NDArray[np.bool_]:
    """Channels (12,) on which a trial takes enough of what is off on average away: gusts average out."""
    left, now = (_power_of_means(t.evidence) for t in (without, trial))
    return np.asarray(
        (left - now > THRESHOLDS.acceptance.share_of_remainder * left)
        & (left - now > THRESHOLDS.acceptance.noticeable_error**2 * _motion(trial))
    )


def _power_of_means(evidence: Evidence) -> Array:
    """Power (12,) of the flights' means of what is left, as ``spectra.power_of`` counts it."""
    return np.asarray(
        sum(0.5 * len(r) * np.abs(r[:, 0].mean(axis=0)) ** 2 for r in (f.residual for f in evidence.flights))
    )


def _motion(trial: FittedSet) -> Array:
    """Power (12,) of what was measured, about the windows' means."""
    return np.asarray(sum((np.abs(f.model.measured[:, 1:]) ** 2).sum(axis=(0, 1)) for f in trial.evidence.flights))


def _in_gusts(trial: FittedSet) -> bool:
    return any(is_gusty(model) for model in trial.fit.models)


def _contributed(base: FittedSet, without: FittedSet, trial: FittedSet) -> Array:
    """Power (12,) that comes back when what a trial has more than another is taken away, the others as they are.

    As a share of what nuisances alone leave, which do their best. The others would bend to hold what is gone: a lag
    twice as long for an engine half as strong. Where the others alone grow without end, so does what comes back.
    """
    kept = [c for c in trial.fit.candidates if c.effect in without.fit.effects]
    lacking = with_candidates(trial.fit, kept, base.fit.nuisances, ()).with_powers(without.fit.powers)
    try:
        lacking = lacking.at(VariableProjection(lacking).points(lacking.values))
    except np.linalg.LinAlgError:
        return np.full(len(CHANNELS), np.inf)
    back, now, whole = (_powers(fit) for fit in (lacking, trial.fit, base.fit))
    return np.asarray(np.max((back - now) / np.maximum(whole, 1e-300), axis=0))


def _powers(fit: CandidateFit) -> Array:
    """Power (2, 12) that a fit leaves of the flights, and without the means, beside which all else may be small."""
    residuals = [flight.residual for flight in fit.flights]
    swinging = [np.concatenate([0.0 * r[:, :1], r[:, 1:]], axis=1) for r in residuals]
    return np.array([sum(power_of(r) for r in some) for some in (residuals, swinging)])


def _trifling(trial: FittedSet) -> bool:
    """Whether what was added is a time within one sample of the slowest topic: a matter of sampling."""
    if trial.added is None or trial.added.effect not in TIME_EFFECTS:
        return False
    slowest = min(min(m.flight.actuator_rate, m.flight.air_rate) for m in trial.fit.models)
    return bool(abs(trial.fit.flights[0].point[trial.added.indices[0]]) < 1.0 / slowest)


def power_left(evidence: Evidence) -> Array:
    """Power (12,) of what is left on flight not fitted."""
    return np.asarray(sum(power_of(flight.residual) for flight in evidence.flights))
