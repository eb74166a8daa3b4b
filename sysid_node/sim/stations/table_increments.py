"""What the aircraft file's lookup tables add to the coefficients, and how that changes with the tables' variables.

A model that was read from another simulator has a hundred tables, and a diagnosis asks for slopes along dozens of
parameters. Tables change with their few variables alone: the slope of each coefficient with each variable is computed
once, and a slope along a parameter is their product with the variables' own slopes.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.dynamics.lookup import PackedTables, interpolate, interpolate_with_slopes
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar

#: Coefficient and variables of each table, in the order of the packed ones.
Places = tuple[tuple[str, tuple[str, ...]], ...]


def table_increments(layout: ParameterLayout, model: AircraftNumbers, x: dict[str, Scalar]) -> dict[str, Scalar]:
    """What the tables add to each coefficient that has any; ``x`` are the regressors by name, of one shape or numbers.

    JAX can differentiate it by ``x``. The tables themselves are known numbers, by which it has no slopes.
    """
    if not isinstance(model.tables, PackedTables):
        return {}
    series = [x[name] * model.airspeed if name == "V" else x[name] for name in _variables(layout.tables)]
    added = _summed(layout.tables, model.tables, jnp.stack(jnp.broadcast_arrays(*series), -1))
    return dict(zip(_coefficients(layout.tables), jnp.unstack(added, axis=-1), strict=True))


def _variables(places: Places) -> list[str]:
    return sorted({variable for _, over in places for variable in over})


def _coefficients(places: Places) -> list[str]:
    return list(dict.fromkeys(coefficient for coefficient, _ in places))


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _summed(places: Places, tables: PackedTables, at: Scalar) -> Scalar:
    """(..., C) the tables' sums at the variables ``at`` (..., V)."""
    return _of_coefficients(places, interpolate(tables, *_arguments(places, at), jnp))


@_summed.defjvp
def _summed_slope(
    places: Places, primals: tuple[PackedTables, Scalar], tangents: tuple[PackedTables, Scalar]
) -> tuple[Scalar, Scalar]:
    """The sums, and their slopes along a change of the variables."""
    (tables, at), (_, change) = primals, tangents
    found = interpolate_with_slopes(tables, *_arguments(places, at), jnp)
    by_first, by_second = _incidence(places)
    slopes = (found.by_first @ by_first + found.by_second @ by_second).reshape(*at.shape[:-1], -1, at.shape[-1])
    return _of_coefficients(places, found.values), (slopes * change[..., None, :]).sum(-1)


def _arguments(places: Places, at: Scalar) -> tuple[Scalar, Scalar]:
    """(..., T) the first and the second variable of each table; a table of one variable has it twice."""
    names = _variables(places)
    return at[..., [names.index(over[0]) for _, over in places]], at[..., [names.index(over[-1]) for _, over in places]]


def _of_coefficients(places: Places, values: Scalar) -> Scalar:
    """(..., C) the sums of the tables' ``values`` (..., T)."""
    owners, coefficients = [coefficient for coefficient, _ in places], _coefficients(places)
    chosen = [[float(owner == name) for name in coefficients] for owner in owners]
    return values @ jnp.array(chosen)


def _incidence(places: Places) -> tuple[Scalar, Scalar]:
    """(T, C V) one where a table is of a coefficient and has a variable as its first; the same for its second."""
    names, coefficients = _variables(places), _coefficients(places)
    found = np.zeros((2, len(places), len(coefficients), len(names)))
    for table, (coefficient, over) in enumerate(places):
        for k, variable in enumerate((over[0], over[-1])):
            found[k, table, coefficients.index(coefficient), names.index(variable)] = 1.0
    first, second = jnp.asarray(found.reshape(2, len(places), -1))
    return first, second
