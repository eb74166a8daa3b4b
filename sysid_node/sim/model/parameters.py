"""All parameters of all effects as one vector: its names, and conversions from texts and to values by name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.errors import InputError
from sysid_node.sim.effects import EFFECTS, SimulationParameter
from sysid_node.sim.effects.base import THROTTLE
from sysid_node.sim.model.layout import ParameterLayout, Scalar, Values
from sysid_node.suggestion import did_you_mean


@cache
def table(layout: ParameterLayout) -> tuple[tuple[str, SimulationParameter], ...]:
    """(effect, parameter) of every entry of the vector, in order."""
    return tuple((effect.name, p) for effect in EFFECTS.values() for p in effect.parameters(layout))


@cache
def names(layout: ParameterLayout) -> tuple[str, ...]:
    """``effect.parameter`` of every entry."""
    return tuple(f"{effect}.{p.name}" for effect, p in table(layout))


#: The vector (P,), or a sequence of its entries, of which then only the varied ones are differentiated.
Parameters = Scalar | Sequence[Scalar]


def unpack(layout: ParameterLayout, theta: Parameters) -> dict[str, Values]:
    """Values by effect and parameter of the vector (P,)."""
    values: dict[str, dict[str, Scalar]] = {}
    entries = jnp.unstack(theta) if isinstance(theta, jax.Array) else theta
    for (effect, parameter), value in zip(table(layout), entries, strict=True):
        values.setdefault(effect, {})[parameter.name] = value
    return dict(values)


def neutral(layout: ParameterLayout) -> NDArray[np.float64]:
    """The vector (P,) at which every effect is neutral."""
    return np.array([p.neutral for _, p in table(layout)])


def vector(
    layout: ParameterLayout, effects: Mapping[str, Mapping[str, float]], base: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """The vector (P,) with these effects; what is not given stays as in ``base`` (default: every effect neutral).

    Raises InputError on an unknown effect or parameter, an impossible value, or an effect that is named but stays
    neutral.
    """
    theta = neutral(layout) if base is None else base.copy()
    before = theta.copy()
    index = {name: i for i, name in enumerate(names(layout))}
    for effect, values in effects.items():
        known = {p.name: p for p in _parameters(layout, effect)}
        for name, inner in _changes(layout, effect, known, values, before).items():
            theta[index[f"{effect}.{name}"]] = inner
        switches = [p for p in known.values() if p.switch]
        if all(theta[i] == before[i] == p.neutral for p in switches for i in [index[f"{effect}.{p.name}"]]):
            raise InputError(_does_nothing(effect, switches))
    return theta


def _changes(
    layout: ParameterLayout,
    effect: str,
    known: Mapping[str, SimulationParameter],
    values: Mapping[str, float],
    base: NDArray[np.float64],
) -> dict[str, float]:
    """New entries of the vector by parameter, from the values of one effect as they are stated."""
    shared = EFFECTS[effect].shared
    meant = {
        key: _resolve(effect, known, key, value) for key, value in values.items() if key not in _controls(effect, known)
    }
    _check_given_once(effect, meant)
    if not shared:
        return {parameter.name: inner for parameter, inner in meant.values()}
    entries = stated_parameters(layout, effect)
    totals = {name: float(base[list(each.entries)].sum()) for name, each in entries.items() if len(each.entries) > 1}
    changed: dict[str, float] = {}
    # first what is meant for all controls, so that a control that is named beside it keeps its own value
    for key in sorted(values, key=lambda key: key in totals):
        if key in totals:
            totals[key] = _value_of_control(effect, known[shared], key, values[key])
            continue
        parameter, inner = meant[key]
        if parameter.name == shared:
            totals = dict.fromkeys(totals, inner)
        else:
            changed[parameter.name] = inner
    least = min(totals.values())
    return {**changed, shared: least, **{name: total - least for name, total in totals.items()}}


def _controls(effect: str, known: Mapping[str, SimulationParameter]) -> set[str]:
    """The parameters of an effect that are added to the one that all controls share."""
    names = EFFECT_NAMES[effect]
    return set(known) - {EFFECTS[effect].shared} - {p.name for p in names.fixed} if EFFECTS[effect].shared else set()


def _check_given_once(effect: str, meant: Mapping[str, tuple[SimulationParameter, float]]) -> None:
    """Raise InputError where two keys mean the same parameter."""
    given: dict[str, str] = {}
    for key, (parameter, _) in meant.items():
        if parameter.name in given:
            raise InputError(f"effect {effect}: {parameter.name!r} is given twice, also as {key!r}; keep one")
        given[parameter.name] = key


def _value_of_control(effect: str, shared: SimulationParameter, control: str, value: float) -> float:
    """What the vector's entries of a control add up to, from the value that is stated for it."""
    of_control = replace(shared, name="", reciprocal=control) if shared.reciprocal else replace(shared, name=control)
    return _resolve(effect, {of_control.name: of_control}, control, value)[1]


@dataclass(frozen=True)
class StatedParameter:
    """A parameter as users state it: the sum of entries of the vector, or the inverse of that sum."""

    entries: tuple[int, ...]
    inverse: bool = False

    def value(self, theta: Scalar | NDArray[np.float64]) -> float:
        """Its value at a vector (P,); infinite where the inverse is zero."""
        total = float(sum(theta[i] for i in self.entries))
        if not self.inverse:
            return total
        return 1.0 / total if total else math.inf


@cache
def stated_parameters(layout: ParameterLayout, effect: str) -> dict[str, StatedParameter]:
    """The parameters of an effect by the names by which users state them: those that act on a control by its name."""
    index = {p.name: i for i, (name, p) in enumerate(table(layout)) if name == effect}
    shared = EFFECTS[effect].shared
    if not shared:
        return {name: StatedParameter((i,)) for name, i in index.items()}
    inverse = bool(table(layout)[index[shared]][1].reciprocal)
    controls = {c: (index[shared], index[c]) for c in (*layout.controls, THROTTLE) if c in index}
    others = {name: StatedParameter((i,)) for name, i in index.items() if name != shared and name not in controls}
    return {**{c: StatedParameter(entries, inverse) for c, entries in controls.items()}, **others}


def stated(layout: ParameterLayout, theta: Scalar | NDArray[np.float64], effect: str) -> dict[str, float]:
    """The parameters of an effect as users state them, at a vector (P,); what is neutral on a control is left out."""
    shared = EFFECTS[effect].shared
    values = {name: parameter.value(theta) for name, parameter in stated_parameters(layout, effect).items()}
    return {name: value for name, value in values.items() if not shared or (value and math.isfinite(value))}


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


def _parameters(layout: ParameterLayout, effect: str) -> tuple[SimulationParameter, ...]:
    _known_effect(effect)
    return EFFECTS[effect].parameters(layout)


def _resolve(
    effect: str, known: Mapping[str, SimulationParameter], key: str, value: float
) -> tuple[SimulationParameter, float]:
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


def _range(parameter: SimulationParameter, key: str) -> str:
    """The range of a key's values, in words."""
    lower, upper, unit = parameter.lower, parameter.upper, parameter.unit
    if key == parameter.reciprocal:
        lower, upper = 1.0 / upper, (1.0 / lower if lower else math.inf)
        unit = "/".join(reversed(unit.split("/")))
    return f"{lower:g} to {upper:g}" + (f" {unit}" if unit != "1" else "")


def _does_nothing(effect: str, switches: Sequence[SimulationParameter]) -> str:
    """The message for an effect that is named but stays neutral."""
    first = switches[0]
    key, value = (
        (first.reciprocal, 1.0 / first.scale) if first.reciprocal else (first.name, first.neutral + first.scale)
    )
    choices = ", ".join(p.reciprocal or p.name for p in switches)
    return f"effect {effect}: does nothing as given; set one of {choices}, e.g. {effect}:{key}={value:g}"
