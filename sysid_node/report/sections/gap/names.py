"""Words for what a gap's report compares: channels, units of an effect's parameters, percentages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.aircraft.names import CONTROL_SYMBOLS
from sysid_node.report.wording.names import COEFFICIENT_WORDS, REGRESSOR_WORDS
from sysid_node.report.wording.numbers import number

T = TypeVar("T")

#: A channel of the comparison -> words.
WORDS = {
    **COEFFICIENT_WORDS,
    "V": "airspeed",
    "alpha": "angle of attack",
    "beta": "sideslip",
    "phi": "roll angle",
    "theta": "pitch angle",
    "psi": "heading",
    "ax": "forward specific force",
    "ay": "sideways specific force",
    "az": "downward specific force",
    **{name: REGRESSOR_WORDS[name] for name in "pqr"},
}


def units_of(effect: str) -> dict[str, str]:
    """Units of the parameters of an effect, where they do not depend on the aircraft."""
    known = EFFECT_NAMES[effect].parameters(tuple(CONTROL_SYMBOLS), throttle=True, derivatives=())
    units = {name: "" if p.unit == "1" else p.unit for name, p in known.items()}
    return {ALL_CONTROLS: next(iter(units.values()), ""), **units}


#: What a cause that acts on all controls alike has in place of a parameter for each.
ALL_CONTROLS = "all controls"


def alike(values: Mapping[str, T]) -> Mapping[str, T]:
    """A cause's parameters by name; those of several controls as one where they are the same."""
    several = len(values) > 1 and all(value == next(iter(values.values())) for value in values.values())
    return {ALL_CONTROLS: next(iter(values.values()))} if several else values


def percent(share: float) -> str:
    """``38 %``."""
    return f"{number(100.0 * share, 2)}\u202f%"


def signal_words(name: str) -> str:
    """A signal of the flight, or a control, in words."""
    return WORDS.get(name) or REGRESSOR_WORDS.get(name, name)
