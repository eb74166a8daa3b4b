"""Derivatives and effects of a simulator by stepwise regression on its flights.

A simulator has no secrets but hardly any noise either, so significance says nothing: any effect improves the fit a
little. The weights of the residual therefore do not look below a small share of the motion, and an effect is added only
where it removes more than that. Effects that the later ones make superfluous are dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, unfitted, with_candidates
from sysid_node.gap.estimation.candidates import PER_CONTROL, Candidate, candidates_of
from sysid_node.gap.estimation.checkpoint import Checkpoint
from sysid_node.gap.estimation.nuisances import DERIVATIVE_ERROR, Nuisances
from sysid_node.gap.estimation.predictive_density import Evidence
from sysid_node.gap.estimation.spectral_weights import spectral_deviance
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.residuals.windowed_spectra import power_of
from sysid_node.gap.selection.candidate_fitter import CandidateFitter, Progress, in_parallel
from sysid_node.gap.selection.fitted_set import FittedSet
from sysid_node.gap.selection.screening import Screened, ScreenedPair, best_screened
from sysid_node.sim import EFFECTS

#: Error, as a share of a channel's motion, below which the fit does not look.
RESOLUTION = 0.003

#: Error, as a share of a channel's motion, that an effect must remove.
_LEAST = 0.006

#: Deviance that an effect must remove for itself and for each of its parameters.
_PENALTY = 10.0

#: Effects that are added one after another, at most, and how many are fitted each time.
_MOST, _FITTED = 6, 3

#: No simulator's own: failures, and what acts as other values of the derivatives, which are estimated here anyway.
_EXCLUDED = frozenset(
    {*PER_CONTROL, DERIVATIVE_ERROR, *(name for name, effect in EFFECTS.items() if effect.station == "mass")}
)


def resolved(model: ResidualModel) -> ResidualModel:
    """The residual model that does not look below the resolution."""
    spectrum = model.windows.smoothed((np.abs(model.measured) ** 2).mean(axis=0))
    spectrum[0] = spectrum[1:].max(axis=0)
    mean = spectrum[1:].mean(axis=0)
    return replace(model, noise=np.maximum(model.noise, RESOLUTION**2 * np.maximum(spectrum, mean)))


def fit_simulator(models: Sequence[ResidualModel], nuisances: Nuisances, progress: Progress) -> CandidateFit:
    """Derivatives and effects fitted to simulated flights, the derivatives as nuisance parameters with wide priors."""
    fitter = CandidateFitter(nuisances, Checkpoint())
    candidates = [c for c in candidates_of(models[0].simulator, models) if c.effect not in _EXCLUDED]
    progress(0.0, "the simulator's derivatives")
    fit = fitter.checkpoint.converged(unfitted(models, nuisances))
    for count in range(_MOST):
        progress((1.0 + count) / (_MOST + 1.0), "the simulator's effects")
        larger = _with_best(fitter, fit, candidates)
        if larger is None:
            break
        fit = larger
    return _without_superfluous(fitter, fit)


def _with_best(fitter: CandidateFitter, fit: CandidateFit, candidates: Sequence[Candidate]) -> CandidateFit | None:
    """The fit with the effect more that improves it most; none where no effect improves it enough."""
    current = FittedSet(fit, Evidence(np.empty(0), ()))
    rest = [c for c in candidates if c.effect not in fit.effects]
    found = fitter.screen(current, rest, lambda share, text: None)
    pairs = best_screened([ScreenedPair(current, each) for each in found], _FITTED)
    larger = in_parallel(lambda pair: _added(fitter, fit, pair.screened), pairs, lambda share: None)
    improved = [each for each in larger if each is not None and _is_improved(fit, each)]
    return min(improved, key=_penalised_deviance, default=None)


def _added(fitter: CandidateFitter, fit: CandidateFit, new: Screened) -> CandidateFit | None:
    """The fit with a screened candidate more; none where the fit gives no numbers."""
    start = with_candidates(fit, [*fit.candidates, new.candidate], fitter.nuisances, new.start)
    try:
        return fitter.checkpoint.converged(start)
    except np.linalg.LinAlgError:
        return None


def _penalised_deviance(fit: CandidateFit) -> float:
    """Minus twice the log posterior density, and a penalty for each effect and parameter."""
    powers = ((flight, (np.abs(flight.residual) ** 2).mean(axis=0)) for flight in fit.flights)
    deviance = sum(spectral_deviance(flight.model, power, flight.point) for flight, power in powers)
    return deviance - 2.0 * fit.prior_score + _PENALTY * (len(fit.candidates) + len(fit.indices))


def _is_improved(smaller: CandidateFit, larger: CandidateFit) -> bool:
    """Whether what was added removes an error that matters, and more deviance than its penalty."""
    removed = error_power(smaller) - error_power(larger)
    return bool((removed > _LEAST**2).any()) and _penalised_deviance(larger) < _penalised_deviance(smaller)


def error_power(fit: CandidateFit) -> Array:
    """Power (12,) of the residual as a share of the motion."""
    left = sum(power_of(flight.residual) for flight in fit.flights)
    motion = sum(model.motion_power for model in fit.models)
    return np.asarray(left / np.maximum(motion, 1e-300))


def _without_superfluous(fitter: CandidateFitter, fit: CandidateFit) -> CandidateFit:
    """The fit without the effects that, put back to the file's value, change no channel by the least error."""
    neutral = fit.simulator.neutral()
    kept = []
    for candidate in fit.candidates:
        points = [flight.point.copy() for flight in fit.flights]
        for point in points:
            point[list(candidate.indices)] = neutral[list(candidate.indices)]
        if (error_power(fit.at(points)) - error_power(fit) > RESOLUTION**2).any():
            kept.append(candidate)
    if len(kept) == len(fit.candidates):
        return fit
    return fitter.checkpoint.converged(with_candidates(fit, kept, fitter.nuisances, ()))
