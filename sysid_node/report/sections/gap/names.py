"""Words for what a gap's report compares: channels, units of an effect's parameters, percentages."""

from __future__ import annotations

from sysid_node.report.wording.names import COEFFICIENT_WORDS, REGRESSOR_WORDS
from sysid_node.report.wording.numbers import number
from sysid_node.sim import EFFECTS
from sysid_node.sim.model.layout import Layout

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
    layout = Layout(("elevator", "aileron", "rudder"), ("de", "da", "dr"), ())
    return {p.name: "" if p.unit == "1" else p.unit for p in EFFECTS[effect].parameters(layout)}


def percent(share: float) -> str:
    """``38 %``."""
    return f"{number(100.0 * share, 2)}\u202f%"


def signal_words(name: str) -> str:
    """A signal of the flight, or a control, in words."""
    return WORDS.get(name) or REGRESSOR_WORDS.get(name, name)
