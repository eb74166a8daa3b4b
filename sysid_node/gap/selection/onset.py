"""The onset of an effect, searched by stepping through the flight.

The deviance has many local minima in an onset, and its slope is zero but at the samples next to it. So every time is
tried, with one step of all other parameters at each: first coarsely, then finely about the best.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidate_fit import CandidateFit, linearised
from sysid_node.gap.estimation.candidates import Candidate
from sysid_node.gap.estimation.variable_projection import VariableProjection
from sysid_node.gap.instruments.gust_free_signals import command_instruments
from sysid_node.gap.instruments.moment_equations import limited_step, moment_equations
from sysid_node.gap.residuals.air_motion import is_gusty
from sysid_node.gap.residuals.parameter_priors import bounds
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS

#: Coarse and fine steps between the times that are tried, and how far about the best the fine ones reach, s.
_COARSE, _FINE, _REACH = 1.5, 0.25, 1.75

#: Step between times whose likelihoods give the uncertainty in still air, s; in gusts it is the coarse one.
_LIKELIHOOD_STEP = 0.5


def search_onset(fit: CandidateFit, candidate: Candidate) -> CandidateFit:
    """The fit with the onset of one of its candidates at the least deviance; the fit itself where none is less.

    That the effect was there before the flight needs no onset. It is kept unless an onset is better by the penalty of
    one more parameter: while a surface is at rest, any time would do.
    """
    names = fit.simulator.names
    places = [fit.indices.index(i) for i in candidate.indices if names[i].endswith(".onset")]
    if not places:
        return fit
    problem, place = VariableProjection(fit), places[0]
    best = (problem.deviance(fit.values), fit.values)
    best = _best_of(problem, best, place, onset_times(fit.models, _COARSE)[0])
    best = _best_of(problem, best, place, best[1][place] + np.arange(-_REACH, _REACH, _FINE))
    throughout = _at(problem, best[1], place, float(fit.simulator.neutral()[fit.indices[place]]))
    values = throughout[1] if throughout[0] <= best[0] + THRESHOLDS.search.penalty else best[1]
    if np.array_equal(values, fit.values):
        return fit
    points = [flight.point.copy() for flight in fit.flights]
    for point in points:
        point[list(fit.indices)] = values
    return fit.at(points)


def onset_uncertainty(fit: CandidateFit, place: int) -> float:
    """Standard error (s) of the onset at this place of the values: rms distance of all times, by their likelihood.

    While a surface is at rest, nothing shows when it failed. In gusts the likelihood is that of what the commands
    predict, because an autopilot moves the surfaces with the gusts.
    """
    moving = any(is_gusty(model) for model in fit.models)
    step_s = _COARSE if moving else _LIKELIHOOD_STEP
    times, widths = onset_times(fit.models, step_s)
    if moving:
        deviance = np.array([_command_deviance(fit, place, float(time)) for time in times])
    else:
        problem = VariableProjection(fit)
        deviance = np.array([_at(problem, fit.values, place, float(time))[0] for time in times])
    weight = widths * np.exp(-0.5 * (deviance - deviance.min()))
    return float(np.sqrt(np.average((times - fit.values[place]) ** 2 + widths**2 / 12.0, weights=weight)))


def onset_times(models: Sequence[ResidualModel], step: float) -> tuple[Array, Array]:
    """Times (K,) at which an effect may have set in, s since the recordings began, and how long (K,) each stands for.

    They are a ``step`` apart within the flights. A pause of a recording is one time, its middle.
    """
    within = [np.arange(model.flight.begin, model.flight.begin + model.record.duration, step) for model in models]
    times = np.unique(np.concatenate(within))
    before = times[:-1][np.diff(times) > 2.0 * step]
    after = times[1:][np.diff(times) > 2.0 * step]
    times = np.sort(np.concatenate([times, 0.5 * (before + after)]))
    edges = 0.5 * (times[1:] + times[:-1])
    widths = np.diff(edges, prepend=times[0] - 0.5 * step, append=times[-1] + 0.5 * step)
    return times, np.asarray(widths)


def _command_deviance(fit: CandidateFit, place: int, time: float) -> float:
    """Deviance of what the commands predict, with an onset at a time and all else at its best."""
    points = [flight.point.copy() for flight in fit.flights]
    for point in points:
        point[fit.indices[place]] = time
    there = linearised(fit.at(points))
    seen = moment_equations(there, fit.powers, command_instruments)
    step = limited_step(seen, there)
    return float(seen.constant - 2.0 * seen.right @ step + step @ seen.information @ step)


def _best_of(problem: VariableProjection, known: tuple[float, Array], place: int, times: Array) -> tuple[float, Array]:
    """Deviance and parameters at the best of these times, or those known so far where these are better."""
    tried = (_at(problem, known[1], place, float(time)) for time in times)
    return min((known, *tried), key=lambda pair: pair[0])


def _at(problem: VariableProjection, values: Array, place: int, time: float) -> tuple[float, Array]:
    """Deviance with an onset at a time, and the parameters after one Gauss-Newton step of all others."""
    there = values.copy()
    there[place] = time
    slopes = problem.jacobian(there)
    slopes[:, place] = 0.0
    low, high = bounds(problem.fit.simulator, problem.indices)
    stepped = np.clip(there + np.linalg.lstsq(slopes, -problem.residual(there), rcond=None)[0], low, high)
    stepped[place] = time
    return min(((problem.deviance(v), v) for v in (there, stepped)), key=lambda pair: pair[0])
