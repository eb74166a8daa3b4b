"""The blocks ``effects`` and ``delays`` of an aircraft file: what the simulator models beyond derivatives."""

from __future__ import annotations

from collections.abc import Mapping

from sysid_node.aircraft.document import DocumentEntry
from sysid_node.aircraft.effect_names import EFFECT_NAMES, EffectNames, EffectParameter
from sysid_node.aircraft.model import DELAY_EFFECTS, NO_DELAYS, Control, Derivative, Throttle, UncertainValue
from sysid_node.aircraft.reading.quantities import ReadNumber, uncertain
from sysid_node.suggestion import did_you_mean

Effects = dict[str, dict[str, UncertainValue]]


def read_delays(entry: DocumentEntry | None) -> dict[str, UncertainValue]:
    """How late each topic's stamps are, s. Raises InputError."""
    fields = entry.fields({}, optional=tuple(NO_DELAYS)) if entry is not None else {}
    expected = "a delay in s, at most 0.5 (is it in ms?)"
    delays = {n: uncertain(e, lambda x: x.number(expected, lambda s: abs(s) <= 0.5)) for n, e in fields.items()}
    return {**NO_DELAYS, **delays}


def read_effects(
    entry: DocumentEntry | None,
    controls: Mapping[str, Control],
    throttle: Throttle | None,
    derivatives: Mapping[str, Derivative],
    delays: Mapping[str, UncertainValue],
) -> Effects:
    """The effects, each with its parameters by name; what is stated for all controls has an entry for each.

    Raises InputError.
    """
    entries = entry.mapping("a mapping from effect to its parameters, e.g. actuator_lag: 0.03") if entry else {}
    effects: Effects = {}
    for name, item in entries.items():
        if name not in EFFECT_NAMES:
            raise item.error(f"effect not known{did_you_mean(name, EFFECT_NAMES)}; known: {', '.join(EFFECT_NAMES)}")
        topic = next((t for t, effect in DELAY_EFFECTS.items() if effect == name and delays[t] != NO_DELAYS[t]), None)
        if topic is not None:
            raise item.error(f"delays.{topic} states the same; keep one")
        known = EFFECT_NAMES[name].parameters(tuple(controls), throttle is not None, derivatives)
        effects[name] = _parameters(item, EFFECT_NAMES[name], known)
    return effects


def _parameters(
    entry: DocumentEntry, names: EffectNames, known: Mapping[str, EffectParameter]
) -> dict[str, UncertainValue]:
    """The parameters of one effect."""
    shared = names.each[0] if names.each else next(iter(known.values())) if len(known) == 1 else None
    everyone = [key for key in known if key not in {p.name for p in names.fixed}] if names.each else list(known)
    if names.each and len(names.each) > 1:  # the controls' first parameters; the others only shape them
        everyone = everyone[: len(everyone) // len(names.each)]
    if not entry.is_mapping or "value" in entry.mapping("a mapping"):
        if shared is None:
            raise entry.mismatch(f"a mapping with some of {', '.join(known)}")
        return dict.fromkeys(everyone, uncertain(entry, _reader(shared)))
    found: dict[str, UncertainValue] = {}
    allowed = [*known, *((names.all_controls,) if names.all_controls else ())]
    items = entry.mapping("a mapping from parameter to value")
    for key, item in items.items():
        if key not in allowed:
            raise item.error(f"parameter not known{did_you_mean(key, allowed)}; known: {', '.join(allowed)}")
    if not items:
        raise entry.error(f"no parameter given; expected some of {', '.join(allowed)}")
    if names.all_controls in items and shared is not None:
        found = dict.fromkeys(everyone, uncertain(items[names.all_controls], _reader(shared)))
    return found | {key: uncertain(item, _reader(known[key])) for key, item in items.items() if key in known}


def _reader(parameter: EffectParameter) -> ReadNumber:
    unit = f" {parameter.unit}" if parameter.unit != "1" else ""
    expected = f"a number from {parameter.lower:g} to {parameter.upper:g}{unit}"
    if parameter.lower == -parameter.upper == float("-inf"):
        expected = f"a number{f' ({parameter.unit})' if unit else ''}"
    return lambda entry: entry.number(expected, lambda x: parameter.lower <= x <= parameter.upper)
