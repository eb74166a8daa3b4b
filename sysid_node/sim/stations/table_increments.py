"""What the aircraft file's lookup tables add to the coefficients, and how that changes with the tables' variables.

A model that was read from another simulator has a hundred tables, and a diagnosis asks for slopes along dozens of
parameters. Tables change with their few variables alone: the slope of each coefficient with each variable is computed
once, and a slope along a parameter is their product with the variables' own slopes.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp

from sysid_node.dynamics.lookup import interpolate, interpolate_with_slopes
from sysid_node.dynamics.packed_tables import PackedTables, Places, coefficients_of, variables_of
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar


def table_increments(layout: ParameterLayout, model: AircraftNumbers, x: dict[str, Scalar]) -> dict[str, Scalar]:
    """What the tables add to each coefficient that has any; ``x`` are the regressors by name, of one shape or numbers.

    JAX can differentiate it by ``x``. The tables themselves are known numbers, by which it has no slopes.
    """
    if not isinstance(model.tables, PackedTables):
        return {}
    series = [x[name] * model.airspeed if name == "V" else x[name] for name in variables_of(layout.tables)]
    added = _summed(layout.tables, model.tables, jnp.stack(jnp.broadcast_arrays(*series), -1))
    return dict(zip(coefficients_of(layout.tables), jnp.unstack(added, axis=-1), strict=True))


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _summed(places: Places, tables: PackedTables, at: Scalar) -> Scalar:
    """(..., C) the tables' sums at the variables ``at`` (..., V)."""
    total: Scalar = interpolate(places, tables, at, jnp)
    return total


@_summed.defjvp
def _summed_slope(
    places: Places, primals: tuple[PackedTables, Scalar], tangents: tuple[PackedTables, Scalar]
) -> tuple[Scalar, Scalar]:
    """The sums, and their slopes along a change of the variables."""
    (tables, at), (_, change) = primals, tangents
    found = interpolate_with_slopes(places, tables, at, jnp)
    return found.values, (found.slopes * change[..., None, :]).sum(-1)
