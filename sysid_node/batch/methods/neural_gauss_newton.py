"""Neural-Gauss-Newton: a network learns how the aircraft moves, then the derivatives are found through it.

Peyada & Ghosh, "Aircraft Parameter Estimation Using a New Filtering Technique Based upon a Neural Network and
Gauss-Newton Method", Aeronautical Journal 113, 2009. A feed-forward network learns how fast the motion changes from the
motion and the aerodynamic coefficients as measured. Then the coefficients that enter it become those of the model, and
Gauss-Newton moves the derivatives until the network's answer is the measured one. No equations of motion are
integrated, no start values needed. What the network learnt of noise it hands on: it is no better than its training.

Longitudinal (CL CD Cm) and lateral (CY Cl Cn) motion each have a network.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import LATERAL, LONGITUDINAL
from sysid_node.batch.regression.coloured_residuals import coloured_covariance
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.filtering import block_averaged, differentiate, lowpass
from sysid_node.batch.regression.linear_regression import Regression
from sysid_node.batch.regression.measured_coefficients import MeasuredCoefficients, at_cg, measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient
from sysid_node.batch.regression.sequential import regression_from_values
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.settings import DEFAULT_LOW_PASS
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

#: Motion, what changes of it, and the coefficients that change it.
_GROUPS = (
    (("V", "alpha", "theta", "q"), ("V", "alpha", "q"), LONGITUDINAL),
    (("beta", "p", "r", "phi"), ("beta", "p", "r"), LATERAL),
)
_HIDDEN = 6
_RATE = 25.0  # Hz: enough for what the low-pass leaves
_DECAY = 1e-4  # what a weight of one costs, as a share of the outputs' variance
_SEED = 1


@dataclass(frozen=True)
class _TrainingData:
    """One group, all flights together: motion (N, m), its rates (N, k), measured coefficients (N, c), the regressors
    of each coefficient; all below the low-pass."""

    motion: Array
    rates: Array
    coefficients: Array
    regressors: dict[str, Array]


def neural_gauss_newton(
    aircraft: Aircraft, records: Sequence[FlightRecord], low_pass: float = DEFAULT_LOW_PASS
) -> BatchFit:
    """The aircraft file's derivatives from all flights together.

    Raises InputError as ``equation_error`` does, and where the attitude was not measured.
    """
    slower = [block_averaged(record, _RATE) for record in records]
    flights = [measured_coefficients(aircraft, record) for record in slower]
    structure = regressors_by_coefficient(aircraft, flights)
    for coefficient, regressors in structure.items():
        effective_degrees_of_freedom(
            [f"{coefficient}_{r}" for r in regressors], [flight.time for flight in flights], low_pass
        )
    fits: dict[str, Regression] = {}
    for motion, changing, coefficients in _GROUPS:
        present = [name for name in coefficients if name in structure]
        if present:
            chosen = {name: structure[name] for name in present}
            pairs = zip(slower, flights, strict=True)
            parts = [_data(aircraft, r, f, motion, changing, chosen, low_pass) for r, f in pairs]
            fits |= _group(chosen, parts, flights)
    return combined_fit("neural_gauss_newton", {name: fits[name] for name in structure}, flights)


def _data(
    aircraft: Aircraft,
    record: FlightRecord,
    flight: MeasuredCoefficients,
    motion: Sequence[str],
    changing: Sequence[str],
    structure: dict[str, tuple[str, ...]],
    low_pass: float,
) -> _TrainingData:
    missing = [name for name in motion if not record.measured(name)]
    if missing:
        raise InputError(f"flight {record.name!r}: neural_gauss_newton needs {', '.join(missing)}, not measured")
    at = at_cg(aircraft, record)
    kept = np.isin(record.time, flight.time)
    smooth = partial(lowpass, flight.time, cutoff=low_pass)
    signals = {name: smooth(at[name][kept][:, None])[:, 0] for name in motion}
    return _TrainingData(
        np.column_stack([signals[name] for name in motion]),
        np.column_stack([differentiate(flight.time, signals[name]) for name in changing]),
        smooth(np.column_stack([flight.coefficients[name] for name in structure])),
        {name: smooth(regressor_matrix(flight, regressors)) for name, regressors in structure.items()},
    )


def _group(
    structure: dict[str, tuple[str, ...]], parts: Sequence[_TrainingData], flights: Sequence[MeasuredCoefficients]
) -> dict[str, Regression]:
    """Trains the group's network, then finds the derivatives through it."""
    motion, rates, measured = (
        np.concatenate([getattr(p, n) for p in parts]) for n in ("motion", "rates", "coefficients")
    )
    scales = [(x.mean(axis=0), np.maximum(x.std(axis=0), 1e-9)) for x in (motion, measured, rates)]
    state, inner, target = ((x - m) / s for x, (m, s) in zip((motion, measured, rates), scales, strict=True))
    weights = _train(np.column_stack([state, inner]), target)
    Xs = [np.concatenate([p.regressors[name] for p in parts]) for name in structure]
    (mean, spread) = scales[1]
    start = np.concatenate([np.linalg.lstsq(X, y, rcond=None)[0] for X, y in zip(Xs, measured.T, strict=True)])
    edges = np.cumsum([X.shape[1] for X in Xs])[:-1]

    def modelled(theta: Array) -> Array:
        return np.column_stack([X @ part for X, part in zip(Xs, np.split(theta, edges), strict=True)])

    def residual(theta: Array) -> Array:
        return np.asarray(target - _answer(weights, state, (modelled(theta) - mean) / spread))

    def slopes(theta: Array) -> Array:
        by_coefficient = np.asarray(_slope(weights, state, (modelled(theta) - mean) / spread)) / spread
        return np.concatenate([by_coefficient[:, :, i, None] * X[:, None, :] for i, X in enumerate(Xs)], axis=2)

    def misses(theta: Array) -> Array:
        return residual(theta).ravel()

    def falls(theta: Array) -> Array:
        return -slopes(theta).reshape(-1, theta.size)

    found = least_squares(misses, start, falls, x_scale="jac", max_nfev=30).x
    return _regressions(structure, found, edges, slopes(found), residual(found), flights)


def _regressions(
    structure: dict[str, tuple[str, ...]],
    found: Array,
    edges: Array,
    slopes: Array,
    residual: Array,
    flights: Sequence[MeasuredCoefficients],
) -> dict[str, Regression]:
    """The derivatives with errors for the colour of what the network leaves."""
    noise = np.maximum(residual.std(axis=0), 1e-12)
    ends = np.cumsum([len(flight.time) for flight in flights])[:-1]
    S, v = slopes / noise[None, :, None], residual / noise
    inverse = np.linalg.pinv(np.tensordot(S, S, axes=([0, 1], [0, 1])), rcond=1e-12, hermitian=True)
    covariance = coloured_covariance(inverse, np.split(S, ends), np.split(v, ends))
    fits = {}
    for (name, regressors), index in zip(structure.items(), np.split(np.arange(found.size), edges), strict=True):
        Xs = [regressor_matrix(flight, regressors) for flight in flights]
        ys = [flight.coefficients[name] for flight in flights]
        names = [f"{name}_{regressor}" for regressor in regressors]
        own = covariance[np.ix_(index, index)]
        spread = float(np.mean(np.concatenate([y - X @ found[index] for y, X in zip(ys, Xs, strict=True)]) ** 2))
        fits[name] = regression_from_values(names, found[index], own / spread, ys, Xs)
    return fits


Weights = tuple[jax.Array, jax.Array, jax.Array, jax.Array]  # into the hidden layer, its bias, out of it, straight


def _network(weights: Weights, inputs: jax.Array) -> jax.Array:
    """One hidden layer beside a straight path; inputs and outputs in units of their spread."""
    into, bias, out, straight = weights
    return jnp.tanh(inputs @ into + bias) @ out + inputs @ straight


@jax.jit
def _answer(weights: Weights, state: jax.Array, coefficients: jax.Array) -> jax.Array:
    return _network(weights, jnp.concatenate([state, coefficients], axis=1))


@jax.jit
def _slope(weights: Weights, state: jax.Array, coefficients: jax.Array) -> jax.Array:
    """d answer / d coefficients (N, k, c)."""
    single = lambda x, c: _network(weights, jnp.concatenate([x, c]))  # noqa: E731
    slope: jax.Array = jax.vmap(jax.jacfwd(single, argnums=1))(state, coefficients)
    return slope


def _train(inputs: Array, target: Array) -> Weights:
    """Weights by least squares with weight decay on all but the straight path, from a seeded start."""
    n, k = inputs.shape[1], target.shape[1]
    shapes = ((n, _HIDDEN), (_HIDDEN,), (_HIDDEN, k), (n, k))
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])

    def unpack(flat: jax.Array) -> Weights:
        a, b, c, d = (part.reshape(s) for part, s in zip(jnp.split(flat, ends[:-1]), shapes, strict=True))
        return a, b, c, d

    def residual(flat: jax.Array) -> jax.Array:
        rest = (target - _network(unpack(flat), jnp.asarray(inputs))).ravel()
        return jnp.concatenate([rest, np.sqrt(_DECAY * len(target)) * flat[: ends[2]]])

    rng = np.random.default_rng(_SEED)
    straight = np.linalg.lstsq(inputs, target, rcond=None)[0]
    start = np.concatenate([0.3 * rng.standard_normal(ends[2]), straight.ravel()])
    value, slope = jax.jit(residual), jax.jit(jax.jacfwd(residual))

    def misses(w: Array) -> Array:
        return np.asarray(value(w))

    def falls(w: Array) -> Array:
        return np.asarray(slope(w))

    found = least_squares(misses, start, falls, method="lm", max_nfev=60)
    return unpack(jnp.asarray(found.x))
