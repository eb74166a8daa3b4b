"""Aerodynamic coefficients as the aircraft file names them: linear in the derivatives, on top of lookup tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import jax
import jax.numpy as jnp

from sysid_node.aircraft.model import Aircraft, LookupTable
from sysid_node.aircraft.names import split_derivative
from sysid_node.batch.models.model import ModelParameter, Scalars
from sysid_node.dynamics.lookup import interpolate
from sysid_node.dynamics.packed_tables import PackedTables, coefficients_of, pack, variables_of
from sysid_node.dynamics.tables import full_thrust, mach_number

Signals = Mapping[str, jax.Array]
#: ``signals, theta -> coefficient -> value``.
Coefficients = Callable[[Signals, Scalars], dict[str, jax.Array]]
#: ``name, signals -> value``.
Regressor = Callable[[str, Signals], jax.Array]
#: ``signals -> coefficient -> what tables add to it``.
TableSum = Callable[[Signals], dict[str, jax.Array]]


def derivative_parameters(
    aircraft: Aircraft, coefficients: Sequence[str], use_prior: bool
) -> tuple[ModelParameter, ...]:
    """The derivatives of these coefficients as parameters that start at the aircraft file's values."""
    return tuple(
        ModelParameter(name, d.value, prior=(d.value, d.tolerance) if use_prior and d.tolerance is not None else None)
        for name, d in aircraft.derivatives.items()
        if split_derivative(name)[0] in coefficients
    )


def coefficient_function(aircraft: Aircraft, names: Sequence[str], reference_rates: bool) -> Coefficients:
    """Coefficients from signals V, alpha, beta, p, q, r and the controls (SI, rad) and theta in the order of ``names``.

    Each holds what the aircraft file's tables add to it; those over the Mach number need ``rho`` (kg/m^3) too,
    those over the throttle ``thrust`` (N; else it is zero).

    Rates are made non-dimensional with the airspeed of the moment, or with the reference airspeed where
    ``reference_rates``. CD_k multiplies CL^2 (parabolic drag polar).
    """
    terms = [split_derivative(name) for name in names]
    modelled = {coefficient for coefficient, _ in terms}
    tables = [table for table in aircraft.tables if table.coefficient in modelled]
    regressor = _regressor_function(aircraft, reference_rates)
    added_by_tables = _table_function(tables, regressor, full_thrust(aircraft)) if tables else None

    def evaluate(signals: Signals, theta: Scalars) -> dict[str, jax.Array]:
        total: dict[str, jax.Array] = {}
        for (coefficient, name), value in zip(terms, theta, strict=True):
            if name != "k":
                total[coefficient] = total.get(coefficient, 0.0) + value * regressor(name, signals)
        if added_by_tables is not None:
            for coefficient, added in added_by_tables(signals).items():
                total[coefficient] = total.get(coefficient, 0.0) + added
        for (coefficient, name), value in zip(terms, theta, strict=True):
            if name == "k":
                total[coefficient] = total.get(coefficient, 0.0) + value * total["CL"] ** 2
        return total

    return evaluate


def _regressor_function(aircraft: Aircraft, reference_rates: bool) -> Regressor:
    """What a derivative is multiplied by, by its name."""
    geometry, speed = aircraft.geometry, aircraft.reference.airspeed
    halves = {"p": geometry.b / 2.0, "q": geometry.cbar / 2.0, "r": geometry.b / 2.0}

    def regressor(name: str, signals: Signals) -> jax.Array:
        if name == "0":
            return jnp.ones_like(signals["V"])
        if name == "V":
            return signals["V"] / speed
        if name in halves:
            return signals[name] * halves[name] / (speed if reference_rates else signals["V"])
        return signals[name]

    return regressor


def _table_function(tables: Sequence[LookupTable], regressor: Regressor, full: float) -> TableSum:
    """What tables add to each coefficient that has any; ``full`` (N): the thrust at full throttle."""
    places, packed = pack(tables)

    def variable(name: str, signals: Signals) -> jax.Array:
        if name == "Mach":
            return jnp.asarray(mach_number(signals["V"], signals["rho"], jnp))
        if name == "throttle":
            return signals.get("thrust", jnp.zeros_like(signals["V"])) / full
        return signals["V"] if name == "V" else regressor(name, signals)

    def added(signals: Signals) -> dict[str, jax.Array]:
        at = jnp.stack(jnp.broadcast_arrays(*(variable(name, signals) for name in variables_of(places))), -1)
        found = interpolate(places, PackedTables(*(jnp.asarray(part) for part in packed)), at, jnp)
        return dict(zip(coefficients_of(places), jnp.unstack(found, axis=-1), strict=True))

    return added
