"""Neural-Gauss-Newton: a network is trained on the aircraft's motion, and the derivatives are fitted through it.

Peyada & Ghosh, "Aircraft Parameter Estimation Using a New Filtering Technique Based upon a Neural Network and
Gauss-Newton Method", Aeronautical Journal 113, 2009. A feed-forward network is trained to give the rates of the motion
from the motion and the measured aerodynamic coefficients. Then its coefficient inputs become those of the model, and
Gauss-Newton changes the derivatives until the network's output is the measured one. No equations of motion are
integrated, and no start values are needed. Noise that the network has fitted passes on to the derivatives.

Longitudinal (CL CD Cm) and lateral (CY Cl Cn) motion each have a network.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import LATERAL, LONGITUDINAL
from sysid_node.batch.regression.coloured_residuals import coloured_covariance
from sysid_node.batch.regression.combined_fit import combined_fit
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.feedforward_network import Weights, network_output, network_slope, train_network
from sysid_node.batch.regression.filtering import block_averaged, differentiate, lowpass
from sysid_node.batch.regression.linear_regression import Regression
from sysid_node.batch.regression.measured_coefficients import MeasuredCoefficients, at_cg, measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix, regressors_by_coefficient
from sysid_node.batch.regression.sequential import regression_from_values
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.settings import DEFAULT_LOW_PASS
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

#: States of the motion, the states whose rates are fitted, and the coefficients that cause these.
_GROUPS = (
    (("V", "alpha", "theta", "q"), ("V", "alpha", "q"), LONGITUDINAL),
    (("beta", "p", "r", "phi"), ("beta", "p", "r"), LATERAL),
)
_RATE = 25.0  # Hz: well above twice the low-pass


@dataclass(frozen=True)
class _TrainingData:
    """Low-passed data of one group: motion (N, m), its rates (N, k), measured coefficients (N, c), the part of these
    that lookup tables add, and the regressors (N, p) of each coefficient."""

    motion: Array
    rates: Array
    coefficients: Array
    tabulated: Array
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
    tables = smooth(np.column_stack([flight.tabulated.get(name, np.zeros_like(flight.time)) for name in structure]))
    signals = {name: smooth(at[name][kept][:, None])[:, 0] for name in motion}
    return _TrainingData(
        np.column_stack([signals[name] for name in motion]),
        np.column_stack([differentiate(flight.time, signals[name]) for name in changing]),
        smooth(np.column_stack([flight.coefficients[name] for name in structure])) + tables,
        tables,
        {name: smooth(regressor_matrix(flight, regressors)) for name, regressors in structure.items()},
    )


def _group(
    structure: dict[str, tuple[str, ...]], parts: Sequence[_TrainingData], flights: Sequence[MeasuredCoefficients]
) -> dict[str, Regression]:
    """The regressions of one group's coefficients, through a network trained on all flights."""
    motion, rates, measured, tables = (
        np.concatenate([getattr(p, n) for p in parts]) for n in ("motion", "rates", "coefficients", "tabulated")
    )
    scales = [(x.mean(axis=0), np.maximum(x.std(axis=0), 1e-9)) for x in (motion, measured, rates)]
    state, inner, target = ((x - m) / s for x, (m, s) in zip((motion, measured, rates), scales, strict=True))
    weights = train_network(np.column_stack([state, inner]), target)
    Xs = [np.concatenate([p.regressors[name] for p in parts]) for name in structure]
    ys = (measured - tables).T
    start = np.concatenate([np.linalg.lstsq(X, y, rcond=None)[0] for X, y in zip(Xs, ys, strict=True)])
    through = _ThroughNetwork(weights, state, target, Xs, (scales[1][0] - tables, scales[1][1]))
    theta = least_squares(through.flat_residual, start, through.jacobian, x_scale="jac", max_nfev=30).x
    return _regressions(structure, theta, through, flights)


class _ThroughNetwork:
    """The network's output as a function of the derivatives theta (p,), which enter through the coefficients."""

    def __init__(
        self, weights: Weights, state: Array, target: Array, Xs: Sequence[Array], scale: tuple[Array, Array]
    ) -> None:
        """``scale``: the coefficients' mean in training less what tables add (N, c), and standard deviation (c,)."""
        self.weights, self.state, self.target, self.Xs = weights, state, target, Xs
        self.mean, self.spread = scale
        self.edges = np.cumsum([X.shape[1] for X in Xs])[:-1]

    def _inputs(self, theta: Array) -> Array:
        """The modelled coefficients (N, c) in the network's units."""
        parts = np.split(theta, self.edges)
        modelled = np.column_stack([X @ part for X, part in zip(self.Xs, parts, strict=True)])
        return np.asarray((modelled - self.mean) / self.spread)

    def residual(self, theta: Array) -> Array:
        """Measured rates less the network's (N, k), in the network's units."""
        return np.asarray(self.target - network_output(self.weights, self.state, self._inputs(theta)))

    def slopes(self, theta: Array) -> Array:
        """The sensitivities (N, k, p) of the network's output to theta."""
        by_coefficient = np.asarray(network_slope(self.weights, self.state, self._inputs(theta))) / self.spread
        return np.concatenate([by_coefficient[:, :, i, None] * X[:, None, :] for i, X in enumerate(self.Xs)], axis=2)

    def flat_residual(self, theta: Array) -> Array:
        """``residual`` as one vector."""
        return self.residual(theta).ravel()

    def jacobian(self, theta: Array) -> Array:
        """The Jacobian of ``flat_residual``."""
        return -self.slopes(theta).reshape(-1, theta.size)


def _regressions(
    structure: dict[str, tuple[str, ...]],
    theta: Array,
    through: _ThroughNetwork,
    flights: Sequence[MeasuredCoefficients],
) -> dict[str, Regression]:
    """The derivatives ``theta`` (p,) with standard errors for coloured residuals of the network."""
    residual, slopes = through.residual(theta), through.slopes(theta)
    noise = np.maximum(residual.std(axis=0), 1e-12)
    ends = np.cumsum([len(flight.time) for flight in flights])[:-1]
    S, v = slopes / noise[None, :, None], residual / noise
    inverse = np.linalg.pinv(np.tensordot(S, S, axes=([0, 1], [0, 1])), rcond=1e-12, hermitian=True)
    covariance = coloured_covariance(inverse, np.split(S, ends), np.split(v, ends))
    regressions = {}
    for (name, regressors), index in zip(
        structure.items(), np.split(np.arange(theta.size), through.edges), strict=True
    ):
        Xs = [regressor_matrix(flight, regressors) for flight in flights]
        ys = [flight.coefficients[name] for flight in flights]
        names = [f"{name}_{regressor}" for regressor in regressors]
        variance = float(np.mean(np.concatenate([y - X @ theta[index] for y, X in zip(ys, Xs, strict=True)]) ** 2))
        block = covariance[np.ix_(index, index)] / variance
        regressions[name] = regression_from_values(names, theta[index], block, ys, Xs)
    return regressions
