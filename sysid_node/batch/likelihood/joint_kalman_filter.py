"""A Kalman filter for state and parameters together, whatever its prediction and correction steps.

Jategaonkar, "Flight Vehicle System Identification", 2nd ed. (2015), ch. 7. The free parameters are appended to the
state as constants, x_a = (x, theta) with theta' = 0, so that every sample corrects both. The filter must be told the
process noise and the sensor noise; it does not estimate them. Its standard errors hold where the noise is white and its
level is as told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.batch.likelihood.rollout import output, rk4_step
from sysid_node.batch.models.manoeuvre import ManoeuvreData, check_every_output_measured, check_manoeuvres
from sysid_node.batch.models.model import ModelEquations, StateSpaceModel
from sysid_node.batch.results.parameter_track import ParameterTrack
from sysid_node.batch.results.response import ModelResponse
from sysid_node.errors import InputError
from sysid_node.flight.record import Array

Moments = tuple[jax.Array, jax.Array]  # mean (n,) and covariance (n, n) of the augmented state
VectorFunction = Callable[[jax.Array], jax.Array]


class FilterSteps(NamedTuple):
    """The two steps that distinguish one Kalman filter from another.

    ``predict(move, moments, q)`` gives the moments after ``move`` and white noise of variances ``q`` (n,);
    ``correct(observe, moments, y, r)`` those after the measurement ``y`` (ny,) with noise of variances ``r`` (ny,).
    """

    predict: Callable[[VectorFunction, Moments, jax.Array], Moments]
    correct: Callable[[VectorFunction, Moments, jax.Array, jax.Array], Moments]


@dataclass(frozen=True)
class FilterNoise:
    """What a Kalman filter is told of its uncertainties, in the squared units of states and outputs.

    ``process`` (nx,): variance that process noise adds to each state in a second. ``sensor`` (ny,): variance of the
    outputs' noise. ``start`` (nx + P,): 1 sigma of the initial state and of the free parameters' start values.
    """

    process: Array
    sensor: Array
    start: Array


def filter_along(
    model: StateSpaceModel, manoeuvres: Sequence[ManoeuvreData], noise: FilterNoise, steps: FilterSteps
) -> ParameterTrack:
    """The free parameters of ``model`` after each sample of the manoeuvres, which are filtered one after the other.

    The parameters and their covariance are carried from one manoeuvre to the next; the state starts anew. Raises
    InputError where the data do not fit the model, where outputs have gaps, or where the filter diverges.
    """
    free = tuple(i for i, parameter in enumerate(model.parameters) if not parameter.fixed)
    mean, covariance = model.start[list(free)], np.diag(noise.start[len(model.states) :] ** 2)
    values, errors, times, flown = [], [], [], 0.0
    for manoeuvre in manoeuvres:
        passed = _filtered(model, manoeuvre, noise, steps, (mean, covariance))
        mean, covariance = passed.mean, passed.covariance
        values.append(passed.values)
        errors.append(passed.errors)
        times.append(flown + manoeuvre.time)
        flown += float(manoeuvre.time[-1])
    names = tuple(model.names[i] for i in free)
    return ParameterTrack(
        np.concatenate(times), names, np.concatenate(values), np.concatenate(errors), np.asarray(covariance)
    )


def one_step_predictions(
    model: StateSpaceModel, manoeuvres: Sequence[ManoeuvreData], noise: FilterNoise, steps: FilterSteps
) -> list[ModelResponse]:
    """Outputs of each manoeuvre, each sample predicted from those before it, the parameters fixed at the start values.

    Raises InputError as ``filter_along`` does.
    """
    states = len(model.states)
    fixed = model.fixed()
    known = FilterNoise(noise.process, noise.sensor, noise.start[:states])
    nothing = np.zeros(0), np.zeros((0, 0))
    return [
        ModelResponse(m.name, m.time, model.outputs, m.outputs, _filtered(fixed, m, known, steps, nothing).predicted)
        for m in manoeuvres
    ]


class _Pass(NamedTuple):
    """One manoeuvre filtered: parameters (N, P) and 1 sigma after each sample, predicted outputs (N, ny), the end."""

    values: Array
    errors: Array
    predicted: Array
    mean: Array
    covariance: Array


def _filtered(
    model: StateSpaceModel,
    manoeuvre: ManoeuvreData,
    noise: FilterNoise,
    steps: FilterSteps,
    parameters: tuple[Array, Array],
) -> _Pass:
    """One manoeuvre, from its initial state and the mean (P,) and covariance (P, P) of the free ``parameters``."""
    check_manoeuvres(model, [manoeuvre])
    check_every_output_measured(model, [manoeuvre], "a Kalman filter")
    free = tuple(i for i, parameter in enumerate(model.parameters) if not parameter.fixed)
    mean, covariance = parameters
    states = len(model.states)
    start = np.zeros((states + len(free), states + len(free)))
    start[:states, :states] = np.diag(noise.start[:states] ** 2)
    start[states:, states:] = covariance
    (end_mean, end_covariance), track = _run(
        (model.dynamics, free, steps),
        (manoeuvre.time, manoeuvre.inputs, manoeuvre.outputs),
        (np.concatenate([manoeuvre.initial_state, mean]), start),
        model.start,
        (np.concatenate([noise.process, np.zeros(len(free))]), noise.sensor),
    )
    values, errors, predicted = (np.asarray(series) for series in track)
    _check_finite(manoeuvre, np.column_stack([values, predicted]))
    return _Pass(values, errors, predicted, np.asarray(end_mean)[states:], np.asarray(end_covariance)[states:, states:])


def _check_finite(manoeuvre: ManoeuvreData, series: Array) -> None:
    """Raises InputError where a filter's result (N, n) is not finite."""
    diverged = np.flatnonzero(~np.isfinite(series).all(axis=1))
    if diverged.size:
        raise InputError(
            f"{manoeuvre.name}: the Kalman filter diverged at {manoeuvre.time[diverged[0]]:.2f} s; give smaller "
            "tolerances, start values nearer to the aircraft, or more process noise"
        )


class _AugmentedModel:
    """The model with its free parameters appended to the state, as pure functions of the augmented state (nx + P,)."""

    def __init__(self, dynamics: ModelEquations, free: tuple[int, ...], theta: jax.Array, states: int) -> None:
        self.dynamics, self.free, self.theta, self.states = dynamics, free, theta, states

    def split(self, a: jax.Array) -> tuple[jax.Array, jax.Array]:
        """The state (nx,) and all parameters, the fixed ones included."""
        return a[: self.states], self.theta.at[jnp.array(self.free, dtype=int)].set(a[self.states :])

    def step(self, a: jax.Array, u0: jax.Array, u1: jax.Array, dt: jax.Array) -> jax.Array:
        """The augmented state after one Runge-Kutta step of ``dt`` s; the parameters are constant."""
        x, theta = self.split(a)
        return jnp.concatenate([rk4_step(self.dynamics, x, u0, u1, dt, theta), a[self.states :]])

    def output(self, a: jax.Array, u: jax.Array) -> jax.Array:
        """The outputs (ny,)."""
        x, theta = self.split(a)
        return output(self.dynamics, x, u, theta)


@partial(jax.jit, static_argnums=0)
def _run(
    program: tuple[ModelEquations, tuple[int, ...], FilterSteps],
    data: tuple[jax.Array, jax.Array, jax.Array],
    start: Moments,
    theta: jax.Array,
    variances: tuple[jax.Array, jax.Array],
) -> tuple[Moments, tuple[jax.Array, jax.Array, jax.Array]]:
    """The moments after the last sample, and of each sample parameters, 1 sigma (N, P), predicted outputs (N, ny)."""
    dynamics, free, steps = program
    (time, inputs, outputs), (q, r) = data, variances
    states = start[0].size - len(free)
    augmented = _AugmentedModel(dynamics, free, theta, states)

    def advance(
        moments: Moments, sample: tuple[jax.Array, ...]
    ) -> tuple[Moments, tuple[jax.Array, jax.Array, jax.Array]]:
        u0, u1, y, dt = sample

        def observe(a: jax.Array) -> jax.Array:
            return augmented.output(a, u0)

        corrected = steps.correct(observe, moments, y, r)
        following = steps.predict(lambda a: augmented.step(a, u0, u1, dt), corrected, q * dt)
        deviation = jnp.sqrt(jnp.diag(corrected[1])[states:])
        return following, (corrected[0][states:], deviation, observe(moments[0]))

    ahead = jnp.concatenate([inputs[1:], inputs[-1:]])
    widths = jnp.concatenate([jnp.diff(time), jnp.diff(time)[-1:]])
    return jax.lax.scan(advance, start, (inputs, ahead, outputs, widths))


def predict_linearised(move: VectorFunction, moments: Moments, q: jax.Array) -> Moments:
    """The moments after ``move``, linearised about the mean: P = F P F' + Q."""
    mean, covariance = moments
    transition = jax.jacfwd(move)(mean)
    return move(mean), transition @ covariance @ transition.T + jnp.diag(q)


def linearised_gain(
    observe: VectorFunction, x: jax.Array, covariance: jax.Array, r: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """The Kalman gain K (n, ny) = P H' (H P H' + R)^-1 and H (ny, n), with H the Jacobian of ``observe`` at ``x``."""
    observation = jax.jacfwd(observe)(x)
    cross = covariance @ observation.T
    return jnp.linalg.solve(observation @ cross + jnp.diag(r), cross.T).T, observation


def joseph_covariance(gain: jax.Array, observation: jax.Array, covariance: jax.Array, r: jax.Array) -> jax.Array:
    """The covariance (n, n) after a correction, in Joseph's form, which keeps it positive definite."""
    rest = jnp.eye(len(covariance)) - gain @ observation
    return rest @ covariance @ rest.T + (gain * r) @ gain.T
