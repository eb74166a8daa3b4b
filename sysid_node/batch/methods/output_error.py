"""Maximum likelihood by output error: the model is integrated without the measurements, and fitted to them.

Maine & Iliff, "Application of Parameter Estimation to Aircraft Stability and Control", NASA RP-1168 (1986), ch. 6;
Jategaonkar, "Flight Vehicle System Identification", 2nd ed. (2015), ch. 4. The flight must be free of turbulence: the
method takes the response to gusts for a response to the controls, which biases the estimates. ``filter_error`` models
the turbulence.

The noise covariance is diagonal and found by relaxation; the sensitivities are exact (JAX).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.batch.likelihood import rollout
from sysid_node.batch.likelihood.covariance import assessed_fit
from sysid_node.batch.likelihood.maximum_likelihood import (
    DEFAULT_SEARCH,
    SearchOptions,
    maximise_likelihood,
    responses_with_nuisances_estimated,
)
from sysid_node.batch.likelihood.problem import LikelihoodProblem
from sysid_node.batch.likelihood.unknowns import Unknowns
from sysid_node.batch.models.manoeuvre import ManoeuvreData, check_manoeuvres
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.response import ModelResponse
from sysid_node.flight.record import Array


def output_error(
    model: StateSpaceModel,
    manoeuvres: Sequence[ManoeuvreData],
    *,
    initial_states: Sequence[str] = (),
    biases: Sequence[str] = (),
    search: SearchOptions = DEFAULT_SEARCH,
) -> BatchFit:
    """The fit of the free parameters of ``model`` to all manoeuvres together.

    ``initial_states`` are estimated for each manoeuvre (the others stay as given), and so are ``biases``, constants
    added to the outputs of these names. Raises InputError where the data do not fit the model, are too few, or the
    model diverges from its start values. A search that does not converge is returned, and its message says so.
    """
    check_manoeuvres(model, manoeuvres)
    problem = OutputErrorProblem(Unknowns.of(model, manoeuvres, initial_states, biases))
    z, iterations, complaint = maximise_likelihood(problem, search)
    return assessed_fit("output_error", problem, z, iterations, complaint)


def predict_output_error(
    model: StateSpaceModel,
    manoeuvres: Sequence[ManoeuvreData],
    values: Mapping[str, float],
    *,
    initial_states: Sequence[str] = (),
    biases: Sequence[str] = (),
) -> list[ModelResponse]:
    """The model's responses to other manoeuvres with the parameters at ``values``.

    Initial states and biases belong to a manoeuvre, not to the aircraft. They are estimated.
    """
    fitted = model.started_at(values)
    check_manoeuvres(fitted, manoeuvres)
    problem = OutputErrorProblem(Unknowns.of(fitted, manoeuvres, initial_states, biases))
    return responses_with_nuisances_estimated(problem, problem.start())


class OutputErrorProblem(LikelihoodProblem):
    """The problem whose responses are the model's trajectories, integrated from the initial states alone."""

    def __init__(self, unknowns: Unknowns) -> None:
        super().__init__(unknowns)
        self._measured = [np.isfinite(m.outputs) for m in unknowns.manoeuvres]

    def start(self) -> Array:
        """The start values of the unknowns."""
        return self.unknowns.start()

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the unknowns."""
        return self.unknowns.bounds()

    def responses(self, z: Array) -> list[ModelResponse]:
        """The trajectories of each manoeuvre."""
        u = self.unknowns
        theta = u.theta(z)
        return [
            ModelResponse(
                m.name,
                m.output_time,
                u.model.outputs,
                m.outputs,
                rollout.outputs(u.model, m, theta, u.initial_state(z, i)) + u.bias(z, i),
            )
            for i, m in enumerate(u.manoeuvres)
        ]

    def sensitivities(self, z: Array) -> list[Array]:
        """The derivatives of the trajectories with respect to z."""
        u = self.unknowns
        theta, free = u.theta(z), len(u.free)
        blocks = []
        for i, manoeuvre in enumerate(u.manoeuvres):
            model_block = rollout.sensitivities(u.model, manoeuvre, theta, u.initial_state(z, i), u.free, u.states)
            first = u.nuisances_of(i).start
            block = np.zeros((*manoeuvre.outputs.shape, u.size))
            block[:, :, :free] = model_block[:, :, :free]
            block[:, :, first : first + len(u.states)] = model_block[:, :, free:]
            for k, output in enumerate(u.biases):
                block[:, output, first + len(u.states) + k] = 1.0
            block[~self._measured[i]] = 0.0
            blocks.append(block)
        return blocks
