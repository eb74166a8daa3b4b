"""Aerodynamic coefficients as the aircraft file names them: linear in the derivatives, one regressor each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import jax
import jax.numpy as jnp

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import split_derivative
from sysid_node.batch.models.model import Parameter, Scalars

Signals = Mapping[str, jax.Array]
#: ``signals, theta -> coefficient -> value``.
Coefficients = Callable[[Signals, Scalars], dict[str, jax.Array]]


def derivative_parameters(aircraft: Aircraft, coefficients: Sequence[str], use_prior: bool) -> tuple[Parameter, ...]:
    """The derivatives of these coefficients as parameters that start at the aircraft file's values."""
    return tuple(
        Parameter(name, d.value, prior=(d.value, d.tolerance) if use_prior and d.tolerance is not None else None)
        for name, d in aircraft.derivatives.items()
        if split_derivative(name)[0] in coefficients
    )


def coefficient_function(aircraft: Aircraft, names: Sequence[str], reference_rates: bool) -> Coefficients:
    """Coefficients from signals V, alpha, beta, p, q, r and the controls (SI, rad) and theta in the order of ``names``.

    Rates are made non-dimensional with the airspeed of the moment, or with the reference airspeed where
    ``reference_rates``. CD_k multiplies CL^2 (parabolic drag polar).
    """
    geometry, speed = aircraft.geometry, aircraft.reference.airspeed
    halves = {"p": geometry.b / 2.0, "q": geometry.cbar / 2.0, "r": geometry.b / 2.0}
    terms = [split_derivative(name) for name in names]

    def regressor(name: str, signals: Signals) -> jax.Array:
        if name == "0":
            return jnp.ones_like(signals["V"])
        if name == "V":
            return signals["V"] / speed
        if name in halves:
            return signals[name] * halves[name] / (speed if reference_rates else signals["V"])
        return signals[name]

    def evaluate(signals: Signals, theta: Scalars) -> dict[str, jax.Array]:
        total: dict[str, jax.Array] = {}
        for (coefficient, name), value in zip(terms, theta, strict=True):
            if name != "k":
                total[coefficient] = total.get(coefficient, 0.0) + value * regressor(name, signals)
        for (coefficient, name), value in zip(terms, theta, strict=True):
            if name == "k":
                total[coefficient] = total.get(coefficient, 0.0) + value * total["CL"] ** 2
        return total

    return evaluate
