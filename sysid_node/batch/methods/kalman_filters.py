"""Extended, iterated and unscented Kalman filters for state and parameters together: one pass along the flight.

Jategaonkar (2015), ch. 7; Bell & Cathey, "The Iterated Kalman Filter Update as a Gauss-Newton Method", IEEE Trans. AC
38(2), 1993; Julier & Uhlmann, "Unscented Filtering and Nonlinear Estimation", Proc. IEEE 92(3), 2004.
The parameters join the state as constants, and the filter learns them as it goes. All need the noise levels, which
maximum likelihood finds by itself (``filter_error``'s ``extras`` serve); they are here for comparison, and to watch
estimates form. Errors are the filter's own: honest where noise is white and its levels are right.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.batch.likelihood.rollout import output, rk4_step
from sysid_node.batch.models.model import ManoeuvreData, ModelEquations, StateSpaceModel, check_manoeuvres
from sysid_node.batch.results.batch_fit import ParameterEstimate, confidence_interval
from sysid_node.errors import InputError
from sysid_node.flight.record import Array

#: Gauss-Newton steps of an iterated correction.
_ITERATIONS = 4

#: Spread of the sigma points, and what is known of the distribution's shape (2: Gaussian).
_SPREAD, _SHAPE = 0.5, 2.0

Moments = tuple[jax.Array, jax.Array]  # mean and covariance of the augmented state


@dataclass(frozen=True)
class Track:
    """Estimates over time: ``values`` and ``errors`` (N, P) of the free parameters named ``names``."""

    time: Array
    names: tuple[str, ...]
    values: Array
    errors: Array

    @property
    def final(self) -> dict[str, ParameterEstimate]:
        """The estimates after the last sample."""
        return {
            name: _estimate(name, float(value), float(error))
            for name, value, error in zip(self.names, self.values[-1], self.errors[-1], strict=True)
        }


def extended_kalman(
    model: StateSpaceModel, manoeuvre: ManoeuvreData, q: Array, r: Array, start_deviation: Array
) -> Track:
    """Joint estimation by linearisation.

    ``q`` (nx,) is the variance that process noise adds to each state in a second, ``r`` (ny,) the outputs' noise
    variance, ``start_deviation`` (nx + P,) 1 sigma of the initial state and of the free parameters' start values.
    Raises InputError where data do not fit the model, outputs have gaps, or the filter diverges.
    """
    return _filtered(model, manoeuvre, q, r, start_deviation, _extended_predict, _extended_correct)


def iterated_kalman(
    model: StateSpaceModel, manoeuvre: ManoeuvreData, q: Array, r: Array, start_deviation: Array
) -> Track:
    """Joint estimation, each sample's outputs linearised again where they lead to. As ``extended_kalman``."""
    return _filtered(model, manoeuvre, q, r, start_deviation, _extended_predict, _iterated_correct)


def unscented_kalman(
    model: StateSpaceModel, manoeuvre: ManoeuvreData, q: Array, r: Array, start_deviation: Array
) -> Track:
    """Joint estimation by sigma points: no derivatives, second-order accurate. As ``extended_kalman``."""
    return _filtered(model, manoeuvre, q, r, start_deviation, _unscented_predict, _unscented_correct)


class _Augmented:
    """The model with its free parameters in the state, as pure functions of the augmented state (nx + P,)."""

    def __init__(self, dynamics: ModelEquations, free: tuple[int, ...], theta: jax.Array, states: int) -> None:
        self.dynamics, self.free, self.theta, self.states = dynamics, free, theta, states

    def split(self, a: jax.Array) -> tuple[jax.Array, jax.Array]:
        """State and all parameters."""
        return a[: self.states], self.theta.at[jnp.array(self.free)].set(a[self.states :])

    def step(self, a: jax.Array, u0: jax.Array, u1: jax.Array, dt: jax.Array) -> jax.Array:
        """One Runge-Kutta step; parameters stay."""
        x, theta = self.split(a)
        return jnp.concatenate([rk4_step(self.dynamics, x, u0, u1, dt, theta), a[self.states :]])

    def output(self, a: jax.Array, u: jax.Array) -> jax.Array:
        """Outputs (ny,)."""
        x, theta = self.split(a)
        return output(self.dynamics, x, u, theta)


Predict = Callable[[Callable[[jax.Array], jax.Array], Moments, jax.Array], Moments]
Correct = Callable[[Callable[[jax.Array], jax.Array], Moments, jax.Array, jax.Array], Moments]


def _extended_predict(move: Callable[[jax.Array], jax.Array], moments: Moments, q: jax.Array) -> Moments:
    mean, covariance = moments
    transition = jax.jacfwd(move)(mean)
    return move(mean), transition @ covariance @ transition.T + jnp.diag(q)


def _extended_correct(
    observe: Callable[[jax.Array], jax.Array], moments: Moments, y: jax.Array, r: jax.Array
) -> Moments:
    mean, covariance = moments
    observation = jax.jacfwd(observe)(mean)
    cross = covariance @ observation.T
    gain = _solve(observation @ cross + jnp.diag(r), cross.T).T
    rest = jnp.eye(mean.size) - gain @ observation
    # Joseph's form: the covariance stays positive
    return mean + gain @ (y - observe(mean)), rest @ covariance @ rest.T + (gain * r) @ gain.T


def _iterated_correct(
    observe: Callable[[jax.Array], jax.Array], moments: Moments, y: jax.Array, r: jax.Array
) -> Moments:
    mean, covariance = moments

    def gain_at(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        observation = jax.jacfwd(observe)(x)
        cross = covariance @ observation.T
        return _solve(observation @ cross + jnp.diag(r), cross.T).T, observation

    def again(_: int, x: jax.Array) -> jax.Array:
        gain, observation = gain_at(x)
        # x = mean + K (y - h(x) - H (mean - x))
        return mean + gain @ (y - observe(x) - observation @ (mean - x))

    x = jax.lax.fori_loop(0, _ITERATIONS, again, mean)
    gain, observation = gain_at(x)
    rest = jnp.eye(mean.size) - gain @ observation
    return x, rest @ covariance @ rest.T + (gain * r) @ gain.T


def _unscented_predict(move: Callable[[jax.Array], jax.Array], moments: Moments, q: jax.Array) -> Moments:
    points, weights = _sigma_points(moments)
    moved = jax.vmap(move)(points)
    mean, scatter = _moments_of(moved, weights)
    return mean, scatter + jnp.diag(q)


def _unscented_correct(
    observe: Callable[[jax.Array], jax.Array], moments: Moments, y: jax.Array, r: jax.Array
) -> Moments:
    mean, covariance = moments
    points, weights = _sigma_points(moments)
    seen = jax.vmap(observe)(points)
    expected, scatter = _moments_of(seen, weights)
    innovation = scatter + jnp.diag(r)
    cross = jnp.einsum("k,ki,kj->ij", weights[1], points - mean, seen - expected)
    gain = _solve(innovation, cross.T).T
    after = covariance - gain @ innovation @ gain.T
    return mean + gain @ (y - expected), 0.5 * (after + after.T)


def _sigma_points(moments: Moments) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
    """Points (2n + 1, n) with the weights for means and for covariances."""
    mean, covariance = moments
    n = mean.size
    scale = _SPREAD**2 * 3.0  # n + lambda with kappa = 3 - n
    root = jnp.linalg.cholesky(scale * covariance)
    points = jnp.concatenate([mean[None], mean + root.T, mean - root.T])
    rest = jnp.full(2 * n, 0.5 / scale)
    centre = 1.0 - n / scale
    for_covariance = centre + 1.0 - _SPREAD**2 + _SHAPE
    return points, (jnp.r_[centre, rest], jnp.r_[for_covariance, rest])


def _moments_of(points: jax.Array, weights: tuple[jax.Array, jax.Array]) -> Moments:
    mean = weights[0] @ points
    return mean, jnp.einsum("k,ki,kj->ij", weights[1], points - mean, points - mean)


def _solve(matrix: jax.Array, right: jax.Array) -> jax.Array:
    return jnp.asarray(jnp.linalg.solve(matrix, right))


def _filtered(
    model: StateSpaceModel,
    manoeuvre: ManoeuvreData,
    q: Array,
    r: Array,
    start_deviation: Array,
    predict: Predict,
    correct: Correct,
) -> Track:
    check_manoeuvres(model, [manoeuvre])
    if manoeuvre.every != 1 or not np.isfinite(manoeuvre.outputs).all():
        raise InputError(f"{manoeuvre.name}: a recursive filter needs every sample of an output; cut the flight")
    free = tuple(i for i, parameter in enumerate(model.parameters) if not parameter.fixed)
    start = np.concatenate([manoeuvre.initial_state, model.start[list(free)]])
    values, errors = _run(
        (model.dynamics, free, predict, correct),
        manoeuvre.time,
        manoeuvre.inputs,
        manoeuvre.outputs,
        start,
        model.start,
        np.concatenate([q, np.zeros(len(free))]),
        r,
        start_deviation,
    )
    lost = np.flatnonzero(~np.isfinite(np.asarray(values)).all(axis=1))
    if lost.size:
        raise InputError(
            f"{manoeuvre.name}: the recursive filter diverged at {manoeuvre.time[lost[0]]:.2f} s; give a smaller start "
            "deviation, start values nearer to the aircraft, or more process noise"
        )
    return Track(manoeuvre.time, tuple(model.names[i] for i in free), np.asarray(values), np.asarray(errors))


@partial(jax.jit, static_argnums=0)
def _run(
    method: tuple[ModelEquations, tuple[int, ...], Predict, Correct],
    time: jax.Array,
    inputs: jax.Array,
    outputs: jax.Array,
    start: jax.Array,
    theta: jax.Array,
    q: jax.Array,
    r: jax.Array,
    deviation: jax.Array,
) -> tuple[jax.Array, jax.Array]:
    """Parameters and their standard deviations (N, P) after each sample."""
    dynamics, free, predict, correct = method
    states = start.size - len(free)
    augmented = _Augmented(dynamics, free, theta, states)

    def advance(moments: Moments, sample: tuple[jax.Array, ...]) -> tuple[Moments, Moments]:
        u0, u1, y, dt = sample
        after = correct(lambda a: augmented.output(a, u0), moments, y, r)
        following = predict(lambda a: augmented.step(a, u0, u1, dt), after, q * dt)
        return following, (after[0][states:], jnp.sqrt(jnp.diag(after[1])[states:]))

    ahead = jnp.concatenate([inputs[1:], inputs[-1:]])
    widths = jnp.concatenate([jnp.diff(time), jnp.diff(time)[-1:]])
    _, track = jax.lax.scan(advance, (start, jnp.diag(deviation**2)), (inputs, ahead, outputs, widths))
    return track


def _estimate(name: str, value: float, error: float) -> ParameterEstimate:
    lower, upper = confidence_interval(value, error, np.inf)
    return ParameterEstimate(name, value, error, lower, upper, True, "ok", error)
