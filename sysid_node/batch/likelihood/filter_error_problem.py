"""The estimation problem of filter error: one-step predictions of a steady Kalman filter whose noises are unknown."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.batch.likelihood import steady_kalman_filter
from sysid_node.batch.likelihood.problem import LikelihoodProblem, in_noise_units
from sysid_node.batch.likelihood.unknowns import Priors, Unknowns
from sysid_node.batch.models.manoeuvre import check_every_output_measured
from sysid_node.batch.models.model import ModelEquations, StateSpaceModel
from sysid_node.batch.regression.jackknife import jackknife
from sysid_node.batch.results.response import ModelResponse
from sysid_node.flight.record import Array

#: Largest factor between a noise and its start value; beyond it the gain hardly changes.
_NOISE_RANGE = 1e3

#: 1 sigma of the logarithm of a noise about its start value: a factor of twenty.
_NOISE_PRIOR = 3.0

#: Indices of the free parameters, free initial states, biased outputs and driven states.
Chosen = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...], tuple[int, ...]]


class FilterErrorProblem(LikelihoodProblem):
    """The problem whose responses are one-step predictions; z ends with the logarithms of the noises' 1 sigma."""

    def __init__(self, unknowns: Unknowns, correlated: bool = False) -> None:
        super().__init__(unknowns)
        check_every_output_measured(unknowns.model, unknowns.manoeuvres, "filter error")
        self._correlated = correlated
        self._noise_start = _rough_noise(unknowns)

    def start(self) -> Array:
        """The start values of the unknowns, then those of the noises' logarithms."""
        return np.concatenate([self.unknowns.start(), self._noise_start])

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the unknowns, then of the noises' logarithms."""
        lower, upper = self.unknowns.bounds()
        reach = np.log(_NOISE_RANGE)
        return np.concatenate([lower, self._noise_start - reach]), np.concatenate([upper, self._noise_start + reach])

    def responses(self, z: Array) -> list[ModelResponse]:
        """The one-step predictions of each manoeuvre."""
        return [
            ModelResponse(
                m.name, m.time, self.unknowns.model.outputs, m.outputs, np.asarray(_predict_jit(*self._arguments(i, z)))
            )
            for i, m in enumerate(self.unknowns.manoeuvres)
        ]

    def sensitivities(self, z: Array) -> list[Array]:
        """The derivatives of the predictions with respect to z."""
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
        return dict(zip(noise_names(model), (float(v) for v in scale * np.exp(logs)), strict=True))

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


def noise_names(model: StateSpaceModel) -> list[str]:
    """``process_<state>`` of the driven states, then ``sensor_<output>``, in the order of the noises in z."""
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
