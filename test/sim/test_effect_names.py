"""The table of names for aircraft files against the effects themselves."""

import math

import pytest

from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.sim import EFFECTS
from sysid_node.sim.model.layout import ParameterLayout

LAYOUT = ParameterLayout(("elevator", "aileron", "flap"), ("de", "da", "df"), ("CL_0", "Cm_alpha"))


def test_every_effect_is_listed_in_the_order_of_the_chain():
    assert tuple(EFFECT_NAMES) == tuple(EFFECTS)


@pytest.mark.parametrize("effect", EFFECTS)
def test_parameters_units_and_ranges(effect):
    shared = EFFECTS[effect].shared
    own = {p.name: p for p in EFFECTS[effect].parameters(LAYOUT)}
    names = EFFECT_NAMES[effect]
    known = names.parameters(LAYOUT.controls, True, LAYOUT.derivatives)
    assert set(known) == set(own) - {shared}
    for name, parameter in known.items():
        acts_on_control = bool(shared) and name in (*LAYOUT.controls, "throttle")
        meant = own[shared] if acts_on_control else own[name]
        lower, upper, unit = meant.lower, meant.upper, meant.unit
        if meant.reciprocal:
            lower, upper = 1.0 / meant.upper, math.inf
            unit = "/".join(reversed(unit.split("/")))
        assert (parameter.unit, parameter.upper) == (unit, upper)
        assert parameter.lower == lower or (name == "damping" and effect == "actuator_lag")
    if shared:
        assert names.all_controls == (own[shared].reciprocal or shared)
