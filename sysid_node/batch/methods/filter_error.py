"""Maximum likelihood by filter error, for flights in turbulence.

A steady Kalman filter estimates the states, gusts included, and the parameters are those for which its one-step
predictions are best. Jategaonkar, "Flight Vehicle System Identification", 2nd ed. (2015), ch. 5; Maine & Iliff, NASA
RP-1168.

The criterion is the determinant of the innovations' covariance, diagonal and found by relaxation (Jategaonkar, eq.
5.12). The filter's gain follows from process and measurement noise, both estimated. That always gives a stable filter,
where Jategaonkar's gain from the innovations' covariance needs a constraint. Only the ratio of the two noises
determines the gain; their common size follows from the innovations. Without process noise this is output error.

Outputs must be measured independently: a pitch acceleration differentiated from the pitch rate would predict itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.batch.likelihood.covariance import assessed_fit
from sysid_node.batch.likelihood.filter_error_problem import FilterErrorProblem, noise_names
from sysid_node.batch.likelihood.maximum_likelihood import (
    SearchOptions,
    maximise_likelihood,
    responses_with_nuisances_estimated,
)
from sysid_node.batch.likelihood.unknowns import Unknowns
from sysid_node.batch.models.manoeuvre import ManoeuvreData, check_manoeuvres
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.response import ModelResponse

#: The likelihood is flat in the noises, so that the last digits take long; a hundredth of a standard error is enough.
#: Early rounds are short, because a full search with the first, wrong, noise may end at a local maximum.
FILTER_SEARCH = SearchOptions(rounds=100, tolerance=1e-2, early=3)


def filter_error(
    model: StateSpaceModel,
    manoeuvres: Sequence[ManoeuvreData],
    *,
    initial_states: Sequence[str] = (),
    biases: Sequence[str] = (),
    correlated: bool = False,
    search: SearchOptions = FILTER_SEARCH,
) -> BatchFit:
    """The fit of the free parameters and the process noise to all manoeuvres together.

    ``correlated``: whether the innovations' covariance is full. It should be where one disturbance, such as a gust,
    acts on several outputs, and must not be where one output is derived from another. Each manoeuvre has the steady
    Kalman gain of its first sample's flight condition: cut a flight that changes speed much. ``extras`` of the result
    holds the noises' standard deviations: ``process_<state>`` (unit of the state per root second) and
    ``sensor_<output>``. Raises InputError as ``output_error`` does, and on outputs with gaps. A search that does not
    converge is returned, and its message says so.
    """
    check_manoeuvres(model, manoeuvres)
    problem = FilterErrorProblem(Unknowns.of(model, manoeuvres, initial_states, biases), correlated)
    z, iterations, complaint = maximise_likelihood(problem, search)
    return assessed_fit("filter_error", problem, z, iterations, complaint, problem.noises(z))


def predict_filter_error(
    model: StateSpaceModel,
    manoeuvres: Sequence[ManoeuvreData],
    values: Mapping[str, float],
    noises: Mapping[str, float],
    *,
    initial_states: Sequence[str] = (),
    biases: Sequence[str] = (),
) -> list[ModelResponse]:
    """One-step predictions of other manoeuvres with these parameters and noises (a fit's ``extras``).

    Initial states and biases belong to a manoeuvre, not to the aircraft. They are estimated.
    """
    fitted = model.started_at(values)
    check_manoeuvres(fitted, manoeuvres)
    problem = FilterErrorProblem(Unknowns.of(fitted, manoeuvres, initial_states, biases))
    logs = np.log([noises[name] for name in noise_names(model)])
    return responses_with_nuisances_estimated(problem, np.concatenate([problem.unknowns.start(), logs]))
