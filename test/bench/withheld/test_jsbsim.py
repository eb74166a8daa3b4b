"""Cases of JSBSim models with a withheld effect, and how they are scored. Truth: the rules of the module, by hand."""

from collections import Counter

import pytest

from bench.withheld.jsbsim import scoring
from bench.withheld.jsbsim.drawing import draw, draw_withheld
from bench.withheld.jsbsim.reality import Servo
from sysid_node.aircraft.load import load_aircraft


def test_a_case_is_its_seeds():
    kestrel = load_aircraft("kestrel")
    cases = [draw("final", seed) for seed in range(1, 151)]
    assert cases == [draw("final", seed) for seed in range(1, 151)]
    assert min(Counter(case.aircraft for case in cases).values()) > 30
    assert draw("development", 1) != draw("final", 1)
    for case in cases:
        withheld = draw_withheld("final", case, kestrel)
        assert withheld == draw_withheld("final", case, kestrel)
        assert len(withheld.effects) == {"none": 0, "unlisted": 0, "two": 2}.get(case.kind, 1)
        assert len(withheld.unlisted) == (case.kind == "unlisted")


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.0126])
def test_a_servo_is_late_by_its_delay_and_no_more(delay):
    """Of a step at 400 Hz the area that is lacking is the delay; a fraction of a sample is shared by two."""
    step = 0.0025
    servo = Servo({"command_delay": delay}, 0.0, step)
    assert step * sum(1.0 - servo.move(1.0) for _ in range(12)) == pytest.approx(delay, abs=1e-12)


def _case(kind, true, *causes, verdict="explained"):
    found = [
        {"effect": label.partition(" of ")[0], "label": label, "parameters": parameters, "probability": 0.95,
         "indistinguishable_from": others}
        for label, parameters, others in causes
    ]  # fmt: skip
    return {"kind": kind, "true_sizes": true, "causes": found, "verdict": verdict, "turbulence": "none"}


_LAG = {"actuator_lag": {"elevator": 0.12}}


@pytest.mark.parametrize(
    ("label", "others", "named", "surface"),
    [
        ("actuator_lag of elevator", [], True, True),
        ("actuator_lag of aileron", [], False, False),
        ("actuator_lag of each control", [], True, False),
        ("command_delay of elevator", ["actuator_lag"], True, False),
        ("command_delay of elevator", ["x", "y", "actuator_lag"], False, False),
    ],
)
def test_one_effect_is_first_or_beside_the_first_and_of_the_right_surface(label, others, named, surface):
    case = _case("slow servo", _LAG, (label, {"elevator": [0.12, 0.01]}, others))
    assert (scoring.named(case), scoring.right_surface(case)) == (named, surface)


def test_of_two_effects_both_must_be_named_in_any_order():
    true = {**_LAG, "mass_error": {"error": 0.2}}
    lag, mass = ("actuator_lag of elevator", {"elevator": [0.12, 0.01]}, []), ("mass_error", {"error": [0.2, 0.01]}, [])
    assert scoring.named(_case("two", true, mass, lag))
    assert not scoring.named(_case("two", true, mass))


def test_what_is_closed_is_a_share_of_what_the_true_effect_closes():
    case = _case("one", _LAG)
    case |= {"reflown": {"before": 0.5, "after": 0.14}, "by_truth": {"before": 0.5, "after": 0.1}}
    assert scoring.closed_of_true(case) == pytest.approx(0.9)
    case |= {"by_truth": {"before": 0.5, "after": 0.49}}
    assert scoring.closed_of_true(case) is None


def test_sizes_are_those_of_true_effects_under_their_own_name():
    case = _case("one", _LAG, ("actuator_lag of elevator", {"elevator": [0.13, 0.01]}, []), ("ice", {"x": [1, 1]}, []))
    assert scoring.sizes(case) == [("actuator_lag.elevator", 0.12, 0.13, 0.01)]
