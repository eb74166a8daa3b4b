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

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.batch.likelihood import steady_kalman_filter
from sysid_node.batch.likelihood.covariance import assessed_fit
from sysid_node.batch.likelihood.maximum_likelihood import (
    SearchOptions,
    maximise_likelihood,
    responses_with_nuisances_estimated,
)
from sysid_node.batch.likelihood.problem import LikelihoodProblem, in_noise_units
from sysid_node.batch.likelihood.unknowns import Priors, Unknowns
from sysid_node.batch.models.model import (
    ManoeuvreData,
    ModelEquations,
    StateSpaceModel,
    check_every_output_measured,
    check_manoeuvres,
)
from sysid_node.batch.regression.jackknife import jackknife
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.response import ModelResponse
from sysid_node.flight.record import Array

#: Largest factor between a noise and its start value; beyond it the gain hardly changes.
_NOISE_RANGE = 1e3

#: The likelihood is flat in the noises, so that the last digits take long; a hundredth of a standard error is enough.
#: Early rounds are short, because a full search with the first, wrong, noise may end at a local maximum.
FILTER_SEARCH = SearchOptions(tolerance=1e-2, early=3)

#: 1 sigma of the logarithm of a noise about its start value: a factor of twenty.
_NOISE_PRIOR = 3.0


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
    problem = _FilterError(Unknowns.of(model, manoeuvres, initial_states, biases), correlated)
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
    problem = _FilterError(Unknowns.of(fitted, manoeuvres, initial_states, biases))
    logs = np.log([noises[name] for name in _noise_names(model)])
    return responses_with_nuisances_estimated(problem, np.concatenate([problem.unknowns.start(), logs]))


class _FilterError(LikelihoodProblem):
    """The problem whose responses are one-step predictions; z ends with the logarithms of the noises' 1 sigma."""

    def __init__(self, unknowns: Unknowns, correlated: bool = False) -> None:
        super().__init__(unknowns)
        check_every_output_measured(unknowns.model, unknowns.manoeuvres, "filter error")
        self._correlated = correlated
        self._noise_start = _rough_noise(unknowns)

    def start(self) -> Array:
        return np.concatenate([self.unknowns.start(), self._noise_start])

    def bounds(self) -> tuple[Array, Array]:
        lower, upper = self.unknowns.bounds()
        reach = np.log(_NOISE_RANGE)
        return np.concatenate([lower, self._noise_start - reach]), np.concatenate([upper, self._noise_start + reach])

    def responses(self, z: Array) -> list[ModelResponse]:
        return [
            ModelResponse(
                m.name, m.time, self.unknowns.model.outputs, m.outputs, np.asarray(_predict_jit(*self._arguments(i, z)))
            )
            for i, m in enumerate(self.unknowns.manoeuvres)
        ]

    def sensitivities(self, z: Array) -> list[Array]:
        blocks = []
        for i, manoeuvre in enumerate(self.unknowns.manoeuvres):
            block = np.zeros((*manoeuvre.outputs.shape, z.size))
            block[:, :, self._columns(i, z)] = np.asarray(_predict_jacobian(*self._arguments(i, z)))
            blocks.append(block)
        return blocks

    def priors(self) -> Priors:
        """The parameters' priors, and those of the noises about their start values, so that each is determined."""
        index, mean, sigma = super().priors()
        noises = self.unknowns.size + np.arange(self._noise_start.size)
        noise_sigma = np.full(noises.size, _NOISE_PRIOR)
        return np.r_[index, noises], np.r_[mean, self._noise_start], np.r_[sigma, noise_sigma]

    def noise(self, z: Array) -> Array:
        """The Cholesky factor (ny, ny) of the innovations' covariance, which is full where ``correlated``."""
        independent = super().noise(z)
        if not self._correlated:
            return independent
        errors = in_noise_units(np.concatenate([response.residuals for response in self.responses(z)]), independent)
        correlation = errors.T @ errors / len(errors)
        return np.asarray(independent @ np.linalg.cholesky(correlation + 1e-10 * np.eye(len(correlation))))

    def covariance(
        self, information: Array, sensitivities: Sequence[Array], residuals: Sequence[Array]
    ) -> tuple[Array, float]:
        """By the jackknife, because a filter's sensitivities depend on the noise."""
        return jackknife(information, sensitivities, residuals)

    def noises(self, z: Array) -> dict[str, float]:
        """Standard deviations of process and sensor noise, scaled to the size of the innovations."""
        model, manoeuvre = self.unknowns.model, self.unknowns.manoeuvres[0]
        logs = z[self.unknowns.size :]
        q = np.zeros(len(model.states))
        q[list(_driven(model))], r = np.split(np.exp(2.0 * logs), [len(model.driven_states)])
        theta, x0 = self.unknowns.theta(z), self.unknowns.initial_state(z, 0)
        expected = steady_kalman_filter.innovation_variance(
            model.dynamics, manoeuvre.step, manoeuvre.inputs[0], x0, theta, jnp.asarray(q), jnp.asarray(r)
        )
        scale = np.exp(np.mean(np.log(np.linalg.norm(self.noise(z), axis=1) / np.sqrt(np.asarray(expected)))))
        return dict(zip(_noise_names(model), (float(v) for v in scale * np.exp(logs)), strict=True))

    def _columns(self, index: int, z: Array) -> list[int]:
        """The indices into z of the quantities that this manoeuvre depends on."""
        nuisances = self.unknowns.nuisances_of(index)
        noises = range(self.unknowns.size, z.size)
        return [*range(len(self.unknowns.free)), *range(nuisances.start, nuisances.stop), *noises]

    def _arguments(
        self, index: int, z: Array
    ) -> tuple[ModelEquations, Chosen, Array, Array, Array, Array, Array, Array]:
        u, m = self.unknowns, self.unknowns.manoeuvres[index]
        chosen = (u.free, u.states, u.biases, _driven(u.model))
        local = z[self._columns(index, z)]
        return u.model.dynamics, chosen, m.time, m.inputs, m.outputs, m.initial_state, u.model.start, local


Chosen = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...], tuple[int, ...]]


def _predict(
    dynamics: ModelEquations,
    chosen: Chosen,
    time: jax.Array,
    inputs: jax.Array,
    outputs: jax.Array,
    x0: jax.Array,
    theta: jax.Array,
    local: jax.Array,
) -> jax.Array:
    """Predicted outputs (N, ny) from this manoeuvre's part of z: parameters, initial states, biases, log noises.

    ``chosen``: indices of the free parameters, free initial states, biased outputs and driven states.
    """
    values, states, bias, log_q, log_r = jnp.split(local, np.cumsum([len(part) for part in chosen]))
    theta = theta.at[jnp.array(chosen[0], dtype=int)].set(values)
    x0 = x0.at[jnp.array(chosen[1], dtype=int)].set(states)
    offset = jnp.zeros(outputs.shape[1]).at[jnp.array(chosen[2], dtype=int)].set(bias)
    q = jnp.eye(x0.size)[:, np.array(chosen[3])] @ jnp.exp(2.0 * log_q)  # a product: XLA crashes on the scatter
    return (
        steady_kalman_filter.predictions(dynamics, time, inputs, outputs - offset, x0, theta, q, jnp.exp(2.0 * log_r))
        + offset
    )


_predict_jit = jax.jit(_predict, static_argnums=(0, 1))
_predict_jacobian = jax.jit(jax.jacfwd(_predict, argnums=7), static_argnums=(0, 1))


def _noise_names(model: StateSpaceModel) -> list[str]:
    return [f"process_{name}" for name in model.driven_states] + [f"sensor_{name}" for name in model.outputs]


def _rough_noise(unknowns: Unknowns) -> Array:
    """Logarithms of the noises' start values (nx + ny,), from the second differences of the measured signals.

    Second differences of white noise have six times its variance. Where the model states no process noise, it starts at
    one that moves the state from sample to sample by as much as its sensor's noise.
    """
    model, first = unknowns.model, unknowns.manoeuvres[0]
    second = np.concatenate([np.diff(m.outputs, 2, axis=0) for m in unknowns.manoeuvres])
    size = np.abs(first.outputs).max(axis=0)
    sensor = np.maximum(np.sqrt(np.mean(second**2, axis=0) / 6.0), 1e-6 * (1.0 + size))

    def process(state: str) -> float:
        if model.driven is not None and model.driven[state]:
            return model.driven[state]
        start = first.initial_state[model.states.index(state)]
        moves = sensor[model.outputs.index(state)] if state in model.outputs else 1e-3 * (1.0 + abs(start))
        return float(moves / np.sqrt(first.step))

    return np.asarray(np.log(np.concatenate([[process(state) for state in model.driven_states], sensor])))


def _driven(model: StateSpaceModel) -> tuple[int, ...]:
    """Indices of the states that process noise moves."""
    return tuple(model.states.index(name) for name in model.driven_states)
