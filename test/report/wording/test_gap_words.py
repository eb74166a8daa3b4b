"""A gap's causes in a pilot's words: no symbols, angles in degrees."""

import math

import pytest

from sysid_node.aircraft.effect_names import EFFECT_NAMES
from sysid_node.report.wording.causes import in_pilots_units, label_words, parameter_words

CONTROLS, DERIVATIVES = ("elevator", "aileron", "rudder"), ("Cm_q", "CL_0", "Cl_p")


@pytest.mark.parametrize(
    ("name", "words"),
    [("Cm_q", "pitch damping"), ("q", "pitch rate"), ("alpha", "angle of attack"), ("CL_0", "lift offset"),
     ("time_constant", "time constant"), ("alpha_star", "angle of attack at which the flow separates")],
)  # fmt: skip
def test_parameters_are_words(name: str, words: str) -> None:
    assert parameter_words(name) == words


@pytest.mark.parametrize("effect", sorted(EFFECT_NAMES))
def test_no_parameter_is_a_symbol(effect: str) -> None:
    known = EFFECT_NAMES[effect].parameters(CONTROLS, throttle=True, derivatives=DERIVATIVES)
    for name in known:
        words = parameter_words(name)
        assert "_" not in words
        symbols = {"CL", "CD", "CY", "Cl", "Cm", "Cn", "alpha", "beta", "alphadot", "p", "q", "r"}
        assert not symbols & set(words.split()), (effect, words)


def test_a_cause_names_its_axis_in_words() -> None:
    assert label_words("derivative_error of Cm") == "derivative error of pitching moment"
    assert label_words("actuator_lag of elevator") == "actuator lag of elevator"


def test_angles_are_in_degrees() -> None:
    assert in_pilots_units(math.pi, 0.1 * math.pi, "rad") == pytest.approx((180.0, 18.0, "deg"))
    assert in_pilots_units(0.11, 0.01, "s") == (0.11, 0.01, "s")
