"""What the scorer calls right, case by case. Truth: docs/results/gap_scoreboard.md, textbook intervals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from bench.withheld.closing import beside_servos
from bench.withheld.drawing import LISTED, SETS, draw
from bench.withheld.judging import FAILURE, judge
from bench.withheld.scoreboard import calibration, interval, page
from sysid_node.sim import EFFECTS

GAP = {"shrink_percent": 95.0, "before": 0.5, "after": 0.1, "noise_floor": 0.08}


def _label(kind: str, effects: dict[str, dict[str, float]], plant: str = "cdrw") -> dict[str, Any]:
    return {"kind": kind, "effects": effects, "plant": plant, "turbulence": "none", "servo_lag": 0.007}


def _said(verdict: str, *causes: tuple[str, float, dict[str, list[float]], list[str]]) -> dict[str, Any]:
    keys = ("effect", "probability", "parameters", "indistinguishable_from")
    return {"verdict": verdict, "gap": GAP, "causes": [dict(zip(keys, c, strict=True)) for c in causes]}


def test_one_effect_is_right_where_it_is_named_first_or_among_three() -> None:
    label = _label("one", {"command_delay": {"delay": 0.06}})
    rivals = ["actuator_lag", "command_delay", "imu_delay"]
    assert judge(label, _said("explained", ("command_delay", 0.9, {"delay": [0.06, 0.01]}, []))).right
    assert judge(label, _said("ambiguous", ("actuator_stamp_delay", 0.5, {"delay": [0.06, 0.01]}, rivals))).right
    assert not judge(
        label, _said("ambiguous", ("cg_shift", 0.5, {"x": [0.06, 0.01]}, ["a", "b", "command_delay"]))
    ).right
    assert not judge(label, _said("no_gap")).right


def test_parameters_are_right_within_their_share_or_interval() -> None:
    label = _label("one", {"mass_error": {"error": 0.2}})
    for found, error, right in ((0.225, 0.001, True), (0.25, 0.001, False), (0.25, 0.03, True)):
        said = _said("explained", ("mass_error", 0.9, {"error": [found, error]}, []))
        assert judge(label, said).sized is right


def test_a_rate_is_compared_by_its_reciprocal_and_a_lag_with_the_servos_own() -> None:
    rate = judge(
        _label("one", {"actuator_rate_limit": {"rate": 0.5}}),
        _said(
            "explained",
            ("actuator_rate_limit", 0.9, {"elevator": [0.5, 0.01], "aileron": [0.48, 0.01], "rudder": [0.4, 0.1]}, []),
        ),
    )
    assert rate.parameters == (("actuator_rate_limit.rate", 2.0, 1.0 / 0.48, 0.01 / 0.48**2),)
    lag = judge(
        _label("one", {"actuator_lag": {"time_constant": 0.04}}),
        _said("explained", ("actuator_lag", 0.9, {"time_constant": [0.05, 0.001]}, [])),
    )
    assert lag.parameters[0][1] == pytest.approx(0.047)


@pytest.mark.parametrize(("found", "shown"), [(0.07, 0.06), (0.055, 0.055), (0.04, 0.053)])
def test_late_stamps_are_shown_less_late_by_the_servos_lag(found, shown) -> None:
    label = _label("one", {"actuator_stamp_delay": {"delay": 0.06}})
    said = _said("explained", ("actuator_stamp_delay", 0.9, {"delay": [found, 0.001]}, []))
    assert judge(label, said).parameters[0][1] == pytest.approx(shown)


def test_both_of_two_effects_must_be_named() -> None:
    label = _label("two", {"mass_error": {"error": 0.2}, "cg_shift": {"x": 0.02}})
    first = ("mass_error", 0.9, {"error": [0.2, 0.01]}, [])
    assert judge(label, _said("explained", first)).every is False
    assert judge(label, _said("explained", first, ("drag_rise", 0.5, {}, ["cg_shift"]))).every is True


def test_none_and_unlisted_are_right_by_their_verdicts() -> None:
    blamed = ("mass_error", 0.95, {"error": [0.2, 0.01]}, [])
    assert judge(_label("none", {}), _said("no_gap")).right
    assert not judge(_label("none", {}), _said("explained", blamed)).right
    assert judge(_label("unlisted", {"slosh": {"share": 0.1}}), _said("unknown_effect")).right
    assert not judge(_label("unlisted", {"slosh": {"share": 0.1}}), _said("explained", blamed)).right


def test_what_c172p_always_has_may_be_named_too() -> None:
    inherent = ("propwash", 0.9, {"gain": [3.0, 0.1]}, [])
    true = ("mass_error", 0.9, {"error": [0.2, 0.01]}, [])
    assert judge(_label("none", {}, "c172p"), _said("explained", inherent)).right
    assert judge(_label("one", {"mass_error": {"error": 0.2}}, "c172p"), _said("explained", inherent, true)).right
    assert not judge(_label("one", {"mass_error": {"error": 0.2}}), _said("explained", inherent, true)).right


def test_of_c172p_as_it_is_only_what_it_has_may_be_blamed() -> None:
    """Its load sits 34 mm to the left; a centre of gravity elsewhere is none of its."""
    label = _label("none", {}, "c172p")
    for aside, there in ((-0.036, True), (0.02, False)):
        shift = ("cg_shift", 0.9, {"x": [0.01, 0.03], "y": [aside, 0.003]}, [])
        case = judge(label, _said("unknown_effect", shift))
        assert case.right is there and case.stated == ((0.9, there),)
    assert judge(label, _said("unknown_effect")).right
    assert not judge(label, _said("unsupported")).right


def test_an_onset_within_the_flight_is_measured() -> None:
    label = _label("one", {"control_effectiveness_loss": {"elevator": 0.5, "onset": 20.0}})
    found = {"elevator": [0.5, 0.02], "onset": [21.5, 0.3]}
    assert judge(label, _said("explained", ("control_effectiveness_loss", 0.9, found, []))).onset == pytest.approx(1.5)


def test_the_interval_of_a_share_is_clopper_and_pearsons() -> None:
    """Published: 8 of 10 gives 0.4439 to 0.9748; none of 10 gives 0 to 0.3085."""
    assert interval(8, 10) == pytest.approx((0.4439, 0.9748), abs=1e-4)
    assert interval(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)


def test_calibration_is_the_mean_distance_of_the_bins() -> None:
    """Ten stated 0.95 of which eight are right, ten stated 0.65 of which six are: (0.15 + 0.05) / 2."""
    stated = [(0.95, i < 8) for i in range(10)] + [(0.65, i < 6) for i in range(10)]
    *_, low, high, error = calibration(stated).splitlines()
    assert low.split(" | ")[1:3] == ["0.65", "0.60"] and high.split(" | ")[1:4] == ["0.95", "0.80", "0.44-0.97"]
    assert error.split(" | ")[2] == "0.10"


def test_a_page_is_made_of_few_cases_and_of_none() -> None:
    case = judge(_label("none", {}), _said("no_gap"))
    assert "1 of 1" in page([case])
    assert page([]) == "No case was diagnosed."


def test_every_effect_that_is_drawn_is_the_simulators_and_the_sets_differ() -> None:
    assert set(LISTED) <= set(EFFECTS)
    assert draw("development", 7) == draw("development", 7)
    assert any(draw("development", n) != draw("final", n) for n in range(3))
    assert len(set(SETS.values())) == len(SETS)


def test_the_stated_interval_covers_what_further_flights_show() -> None:
    said = _said("explained", ("mass_error", 0.9, {"error": [0.2, 0.01]}, []))
    said["gap"] = {**GAP, "ci95": [90.0, 97.0]}
    case = judge(_label("one", {"mass_error": {"error": 0.2}}), said)
    assert case.covers is None
    further = {"before": 0.5, "after": 0.1, "noise_floor": 0.08, "shrink_percent": 95.2}
    assert replace(case, further=further).covers is True
    assert replace(case, further={**further, "shrink_percent": 88.0}).covers is False
    whole = replace(case, gap={**case.gap, "ci95": [90.0, 100.0]})
    assert replace(whole, further={**further, "shrink_percent": 100.00000000000001}).covers is True  # rounding
    assert replace(case, further={**further, "noise_floor": 0.49}).covers is None  # next to no gap


def test_times_found_hold_the_servos_own() -> None:
    """Which the plant's have by themselves: once, whichever of the times is found."""
    lag = {"actuator_lag": {"time_constant": 0.108}}
    assert beside_servos(lag, 0.008) == {"actuator_lag": {"time_constant": pytest.approx(0.1)}}
    both = {**lag, "command_delay": {"delay": 0.005}}
    assert beside_servos(both, 0.008) == {**lag, "command_delay": {"delay": 0.0}}
    early = {"actuator_stamp_delay": {"delay": 0.05}, "imu_bias": {"ax": 0.1}}
    assert beside_servos(early, 0.008) == {**early, "actuator_stamp_delay": {"delay": pytest.approx(0.058)}}
    apart = {"actuator_lag": {"elevator": 0.108, "rudder": 0.005}}
    assert beside_servos(apart, 0.008) == {"actuator_lag": {"elevator": pytest.approx(0.1), "rudder": 0.0}}
    assert beside_servos({"imu_bias": {"ax": 0.1}}, 0.008) == {"imu_bias": {"ax": 0.1}}


@pytest.mark.parametrize(
    ("kind", "plant"), [("none", "cdrw"), ("none", "c172p"), ("one", "cdrw"), ("unlisted", "cdrw")]
)
def test_a_diagnosis_that_ends_in_an_error_is_wrong(kind: str, plant: str) -> None:
    effects = {} if kind == "none" else {"imu_bias": {"ax": 0.1}}
    assert not judge(_label(kind, effects, plant), FAILURE).right
