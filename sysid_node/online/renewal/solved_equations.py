"""The solution of all equations of a renewal, the covariance of its errors, and how far instruments are trusted."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.online.alignment import flow_angle_errors
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.regression import (
    gust_correlation,
    least_squares,
    normal_equations,
    overidentification,
    regressor_noise,
    weak_instruments,
)
from sysid_node.online.regression.information import Information
from sysid_node.online.regression.least_squares import InstrumentStrength, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.regression.selection_bias import selection_bias_factors
from sysid_node.online.renewal.segment_information import line_seconds
from sysid_node.online.state import EstimatorState, InstrumentChecks

Array = NDArray[np.float64]


class SolvedEquations(NamedTuple):
    """The solution of all equations, and how far it can be trusted."""

    solution: Solution
    compensation: Array | None  # noise's part of the normal equations
    noise: Array | None  # (W, W) of which that was made, per line and second
    statistical: Uncertainty  # without the bias by gusts, which is the same in later flight
    spread: Uncertainty  # with that bias
    inflation: Array  # (C,) factors of the variances by gusts
    scatter: Array  # (C,) factors of the variances by the scatter of the bands' estimates
    gusts: Array  # (C,) share of the residuals that is not the sensors' noise
    sensed: Array  # (C,) density of the sensors' noise in the residuals
    instruments: InstrumentChecks


def solved_equations(state: EstimatorState, total: Information, gram: Array) -> SolvedEquations:
    """By the equations that the instruments' strength allows, which are the state's from now on."""
    strength, solution, compensation, noise = _solve(state, total, gram)
    equations = state.equations
    spread = least_squares.uncertainty(equations, solution, total)
    noise_alone = spread.covariance
    if state.flow.active:
        spread.covariance = noise_alone + _reconstruction_covariance(state, solution, total)
    sensed = _sensed(state, total, equations, solution)
    gusts = gust_correlation.share_of_gusts(spread.density, sensed)
    statistical = spread
    spread = _with_gust_bias(state, total, gram, solution, statistical, gusts)
    checks = _instrument_checks(state, total, gram, strength, solution, spread, noise_alone, gusts)
    answered = gust_correlation.of_solution(equations, solution, gram, gusts)
    inflation = gust_correlation.inflation(spread, gusts, answered)
    scatter = np.where(equations.instrumented, _scatter(equations, solution, total, statistical), 1.0)
    return SolvedEquations(
        solution, compensation, noise, statistical, spread, inflation, scatter, gusts, sensed, checks
    )


def _scatter(equations: NormalEquations, solution: Solution, total: Information, spread: Uncertainty) -> Array:
    """(C,) factors of the variances by the scatter of the bands' estimates; one where too little was measured."""
    if not solution.usable or total.trace_square <= 0.0:
        return np.ones(equations.outputs.size)
    found = overidentification.overidentification(equations, solution, total, spread)
    return overidentification.variance_factors(equations, found, len(total.grams))


def _solve(
    state: EstimatorState, total: Information, gram: Array
) -> tuple[InstrumentStrength, Solution, Array | None, Array | None]:
    """The instruments' strength, the solution by the equations that it allows, and the noise's part in them.

    The last is the noise's Gram matrix (W, W) per line and second.
    """
    full, last = state.model.equations, state.latest
    instrument_strength = least_squares.instrument_strength(full, least_squares.solve(full, gram), total)
    equations = state.equations = normal_equations.with_strong_instruments(full, instrument_strength.strength)
    compensation, noise, amount = None, None, line_seconds(state, total)
    if last is not None and last.solution.usable:
        noise = total.bias / amount
        share = regressor_noise.allowed(equations, last.solution, last.uncertainty.density, noise)
        noise = noise * share[:, None] * share
        compensation = least_squares.bias_of(equations, amount * noise)
    solution = least_squares.solve(equations, gram, compensation)
    if compensation is not None and not solution.usable:
        solution, compensation, noise = least_squares.solve(equations, gram), None, None
    return instrument_strength, solution, compensation, noise


def _instrument_checks(
    state: EstimatorState,
    total: Information,
    gram: Array,
    strength: InstrumentStrength,
    solution: Solution,
    spread: Uncertainty,
    noise_alone: Array,
    gusts: Array,
) -> InstrumentChecks:
    """How far the instruments can be trusted; ``noise_alone`` (C, P, P) is the covariance that noise makes."""
    equations, table = state.equations, state.model.table
    mean = total.integrals[equations.columns] / max(float(total.integrals[OFFSET]), 1e-12)
    return InstrumentChecks(
        strength,
        selection_bias_factors(equations, solution, spread, strength, gram, *state.model.prior),
        weak_instruments.anderson_rubin_bounds(equations, table, solution, gram, spread, noise_alone, mean, gusts),
        gust_correlation.only_answered(state.model.instrumented, gram, gusts),
    )


def _with_gust_bias(
    state: EstimatorState, total: Information, gram: Array, solution: Solution, spread: Uncertainty, gusts: Array
) -> Uncertainty:
    """With the bias by ``gusts`` (C,) of the equations that are solved by least squares though they have instruments.

    These are all with ``sls_rft``, and with ``iv_rft`` those whose instruments are weak.
    """
    equations = state.equations
    biased = state.model.instrumented.instrumented & ~equations.instrumented
    share = np.where(biased, gust_correlation.share_by_axis(equations.structure.coefficients, gusts), 0.0)
    if not share.any():
        return spread
    share = share[:, None, None]
    unbiased = _covariance_in_gusts(state, total, gram, solution)
    return replace(spread, covariance=(1.0 - share) * spread.covariance + share * unbiased)


def _covariance_in_gusts(state: EstimatorState, total: Information, gram: Array, solution: Solution) -> Array:
    """(C, P, P) mean squared errors of least squares where all of the residual is of gusts.

    Regressors that are their own instruments hold the gusts that are in the residual, other instruments do not. What
    is known of the truth is then the solution by instruments with its covariance, and least squares is off from it by
    the difference d of both (Hausman (1978), Econometrica 46(6)): d d' and that covariance.
    """
    full = state.model.instrumented
    unbiased = least_squares.solve(full, gram)
    known = least_squares.uncertainty(full, unbiased, total)
    scatter = _scatter(full, unbiased, total, known)[:, None, None]
    factor = np.sqrt(least_squares.instrument_strength(full, unbiased, total).selection_factor)
    off = (solution.theta - unbiased.theta).T
    return np.asarray(off[:, :, None] * off[:, None, :] + scatter * known.covariance * np.outer(factor, factor))


def _reconstruction_covariance(state: EstimatorState, solution: Solution, total: Information) -> Array:
    """(C, P, P) covariance that errors of the aircraft file cause through reconstructed flow angles."""
    model = state.model
    return flow_angle_errors.reconstruction_covariance(
        state.flow,
        state.transform.last,
        model.aircraft,
        model.layout,
        model.spectrum,
        state.equations,
        solution,
        total,
        mean_bounded=model.imperfections is None,
    )


def _sensed(state: EstimatorState, total: Information, equations: NormalEquations, solution: Solution) -> Array:
    """(C,) density of the sensors' noise in the residuals."""
    aircraft, omega = state.model.aircraft, state.model.spectrum.omega
    per_line, step = total.bias / line_seconds(state, total), total.energy / max(total.samples, 1.0)
    return gust_correlation.sensed(aircraft, equations, solution, per_line, total.noise_moments, step, omega)
