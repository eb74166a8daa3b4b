"""Words for causes and for what the pages of gaps and fleets compare: channels, parameters with units, percentages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeVar

from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.aircraft.names import CONTROL_SYMBOLS
from sysid_node.report.wording.names import COEFFICIENT_WORDS, REGRESSOR_WORDS, short_meaning, split_name, words_of
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


#: Words for parameters of effects whose names are symbols.
_PARAMETERS = {
    "alpha_star": "angle of attack at which the flow separates",
    "a1": "abruptness of the separation",
    "tau1": "lag of the separation",
    "tau2": "lag of the separation behind the angle of attack",
    "CD_X": "drag of the separated flow",
    "Cm_X": "pitching moment of the separated flow",
    "CL_alphadot": "lift due to the rate of the angle of attack",
    "Cm_alphadot": "pitching moment due to the rate of the angle of attack",
    "Cl_beta_alpha": "dihedral effect per angle of attack",
    "Cn_beta_alpha": "weathercock stability per angle of attack",
    "Cl_r_alpha": "rolling moment due to yaw rate, per angle of attack",
    "p_factor": "P-factor",
}

#: Units in which a pilot thinks: SI unit -> factor and unit.
_PILOTS = {"rad": (180.0 / math.pi, "deg"), "rad/s": (180.0 / math.pi, "deg/s")}

#: On what a gap is measured (``Diagnosis.measured_on``), in words.
MEASURED_ON = {
    "held_out": "the flight held out",
    "parts": "parts of the flight that were not fitted",
    "fitted": "the flight that was fitted (its only manoeuvre cannot be divided)",
}


def parameter_words(name: str) -> str:
    """A parameter of an effect in words: ``"Cm_q"`` is ``"pitch damping"``, ``"q"`` is ``"pitch rate"``."""
    known = _PARAMETERS.get(name) or WORDS.get(name)
    return known or (short_meaning(name) if split_name(name)[0] else words_of(name))


def label_words(label: str) -> str:
    """A cause in words: ``"derivative_error of Cm"`` is ``"derivative error of pitching moment"``."""
    effect, separator, part = label.partition(" of ")
    return f"{words_of(effect)}{separator}{parameter_words(part)}"


def in_pilots_units(value: float, error: float, unit: str) -> tuple[float, float, str]:
    """Value, standard error and unit with angles in degrees."""
    factor, name = _PILOTS.get(unit, (1.0, unit))
    return factor * value, factor * error, name


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
