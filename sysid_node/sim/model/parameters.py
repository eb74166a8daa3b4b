"""All parameters of all effects as one vector: its names, and conversions from texts and to values by name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError
from sysid_node.sim.effects import EFFECTS, Parameter
from sysid_node.sim.model.layout import Layout, Scalar, Values
from sysid_node.suggestion import did_you_mean


@cache
def table(layout: Layout) -> tuple[tuple[str, Parameter], ...]:
    """(effect, parameter) of every entry of the vector, in order."""
    return tuple((effect.name, p) for effect in EFFECTS.values() for p in effect.parameters(layout))


@cache
def names(layout: Layout) -> tuple[str, ...]:
    """``effect.parameter`` of every entry."""
    return tuple(f"{effect}.{p.name}" for effect, p in table(layout))


#: The vector (P,), or a sequence of its entries, of which then only the varied ones are differentiated.
Parameters = Scalar | Sequence[Scalar]


def unpack(layout: Layout, theta: Parameters) -> dict[str, Values]:
    """Values by effect and parameter of the vector (P,)."""
    values: dict[str, dict[str, Scalar]] = {}
    entries = jnp.unstack(theta) if isinstance(theta, jax.Array) else theta
    for (effect, parameter), value in zip(table(layout), entries, strict=True):
        values.setdefault(effect, {})[parameter.name] = value
    return dict(values)


def neutral(layout: Layout) -> NDArray[np.float64]:
    """The vector (P,) at which every effect is neutral."""
    return np.array([p.neutral for _, p in table(layout)])


def vector(layout: Layout, effects: Mapping[str, Mapping[str, float]]) -> NDArray[np.float64]:
    """The vector (P,) with these effects and all others neutral.

    Raises InputError on an unknown effect or parameter, an impossible value, or an effect that is named but stays
    neutral.
    """
    theta = neutral(layout)
    index = {name: i for i, name in enumerate(names(layout))}
    for effect, values in effects.items():
        known = {p.name: p for p in _parameters(layout, effect)}
        given: set[str] = set()
        for key, value in values.items():
            parameter, inner = _resolve(effect, known, key, value)
            if parameter.name in given:
                raise InputError(f"effect {effect}: {parameter.name!r} is given twice, also as {key!r}; keep one")
            given.add(parameter.name)
            theta[index[f"{effect}.{parameter.name}"]] = inner
        switches = [p for p in known.values() if p.switch]
        if all(theta[index[f"{effect}.{p.name}"]] == p.neutral for p in switches):
            raise InputError(_does_nothing(effect, switches))
    return theta


def parse(specs: Sequence[str]) -> dict[str, dict[str, float]]:
    """Values by effect and key, of texts ``name:key=value:key=value``. Raises InputError on any other form."""
    effects: dict[str, dict[str, float]] = {}
    for spec in specs:
        name, *pairs = spec.split(":")
        _known_effect(name)
        if name in effects:
            raise InputError(
                f"effect {name!r} is given twice; give one with all of its keys, as {name}:key=value:key=value"
            )
        for pair in pairs:
            key, _, text = pair.partition("=")
            if key in effects.setdefault(name, {}):
                raise InputError(f"effect {spec!r}: {key!r} is given twice; keep one")
            try:
                effects[name][key] = float(text)
            except ValueError:
                raise InputError(
                    f"effect {spec!r}: {pair!r}: expected key=number, e.g. actuator_lag:time_constant=0.05"
                ) from None
        effects.setdefault(name, {})
    return effects


def _known_effect(name: str) -> None:
    if name not in EFFECTS:
        raise InputError(f"effect {name!r} is not known; known: {', '.join(EFFECTS)}{did_you_mean(name, EFFECTS)}")


def _parameters(layout: Layout, effect: str) -> tuple[Parameter, ...]:
    _known_effect(effect)
    return EFFECTS[effect].parameters(layout)


def _resolve(effect: str, known: Mapping[str, Parameter], key: str, value: float) -> tuple[Parameter, float]:
    """The parameter that a key names, and its value in the vector. Raises InputError on an impossible value."""
    by_everyday_name = {p.reciprocal: p for p in known.values() if p.reciprocal}
    parameter = known.get(key) or by_everyday_name.get(key)
    if parameter is None:
        keys = [*known, *by_everyday_name]
        raise InputError(f"effect {effect}: {key!r} is not known; known: {', '.join(keys)}{did_you_mean(key, keys)}")
    inner = value if key in known else (1.0 / value if value else math.inf)
    if not (math.isfinite(inner) and parameter.lower <= inner <= parameter.upper):
        raise InputError(f"effect {effect}: {key}={value:g} is impossible; expected {_range(parameter, key)}")
    return parameter, inner


def _range(parameter: Parameter, key: str) -> str:
    """The range of a key's values, in words."""
    lower, upper, unit = parameter.lower, parameter.upper, parameter.unit
    if key == parameter.reciprocal:
        lower, upper = 1.0 / upper, (1.0 / lower if lower else math.inf)
        unit = "/".join(reversed(unit.split("/")))
    return f"{lower:g} to {upper:g}" + (f" {unit}" if unit != "1" else "")


def _does_nothing(effect: str, switches: Sequence[Parameter]) -> str:
    """The message for an effect that is named but stays neutral."""
    first = switches[0]
    key, value = (
        (first.reciprocal, 1.0 / first.scale) if first.reciprocal else (first.name, first.neutral + first.scale)
    )
    choices = ", ".join(p.reciprocal or p.name for p in switches)
    return f"effect {effect}: does nothing as given; set one of {choices}, e.g. {effect}:{key}={value:g}"
