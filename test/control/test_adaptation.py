"""Gates, checks over the confidence region, bounded movement, fall-back: what is flown, and when."""

import math
from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from flying import AIRCRAFT, NAN, STEP, beliefs, level

from sysid_node.control import controller
from sysid_node.control.design.axis import axes
from sysid_node.control.design.confidence_region import region_points
from sysid_node.control.design.margins import margins
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import ErrorCorrelation, IdentifiedDerivative, SetPoints
from sysid_node.errors import InputError

ELEVATOR = {"Cm_de": 0.4, "CL_de": 0.4}


def flown(state: controller.ControllerState, seconds: float, estimates: object, start: float = 0.0) -> float:
    """Level flight with the same estimates at 20 Hz; returns when it ended, s."""
    count = round(seconds / STEP)
    for k in range(count):
        now = start + k * STEP
        if estimates is not None and k % 10 == 0:
            controller.receive_estimates(state, now, estimates)
        controller.step(state, level(now), SetPoints())
    return start + count * STEP


@cache
def _begun() -> controller.ControllerState:
    return controller.init(AIRCRAFT, ControllerSettings())


@pytest.fixture
def state() -> controller.ControllerState:
    """A controller that has not flown yet; its baseline is designed once."""
    return deepcopy(_begun(), {id(AIRCRAFT): AIRCRAFT})


@cache
def _weakened() -> tuple[controller.ControllerState, float]:
    state = controller.init(AIRCRAFT, ControllerSettings())
    return state, flown(state, 6.0, beliefs(ELEVATOR, half=0.02))


def weakened() -> tuple[controller.ControllerState, float]:
    """A controller after 6 s with estimates of a weak elevator, flown once; and the time, s."""
    state, end = _weakened()
    return deepcopy(state, {id(AIRCRAFT): AIRCRAFT}), end


@cache
def _adapted_to_the_unstable() -> controller.ControllerState:
    state = controller.init(AIRCRAFT, ControllerSettings())
    controller.receive_correlation(state, ErrorCorrelation(tuple(UNSTABLE), TOGETHER))
    flown(state, 6.0, unstable())
    return state


def baseline(state: controller.ControllerState) -> bool:
    """Whether the baseline's gains are flown."""
    return all(np.allclose(axis.flown.gains, axis.axis.baseline) for axis in state.axes)


def test_the_baseline_has_good_margins() -> None:
    for axis in axes(AIRCRAFT, 0.05, 0.02):
        found = margins(axis.model(axis.believed), axis.baseline, axis.delay)
        assert bool(found.enough(10.0 ** (12.0 / 20.0), math.radians(60.0)))


def test_estimates_equal_to_the_file_change_nothing(state: controller.ControllerState) -> None:
    flown(state, 3.0, beliefs(half=0.02))
    assert state.axes[0].verdict == "adapted"
    for axis in state.axes:
        np.testing.assert_allclose(axis.flown.gains, axis.axis.baseline, rtol=1e-6, atol=1e-9)


@pytest.mark.slow
def test_a_surface_of_less_effect_gets_more_gain() -> None:
    """Gains in the moments that they make stay what they were: 1 / 0.4 of the baseline's."""
    state, _ = weakened()
    pitch = state.axes[0]
    assert pitch.verdict == "adapted"
    ratio = pitch.flown.gains[0, 1:4] / pitch.axis.baseline[0, 1:4]
    np.testing.assert_allclose(ratio, 2.5, rtol=0.01)


@pytest.mark.parametrize(
    "changes",
    [{"valid": False}, {"r_squared": 0.5}, {"value": NAN}, {"lower": -math.inf}, {"lower": NAN, "upper": NAN}],
)
def test_what_is_not_to_be_trusted_is_not_used(state: controller.ControllerState, changes: dict[str, float]) -> None:
    flown(state, 3.0, beliefs(ELEVATOR, **changes))
    assert baseline(state)
    assert all(axis.accepted == 0 for axis in state.axes)


def test_wide_intervals_are_not_used(state: controller.ControllerState) -> None:
    flown(state, 3.0, beliefs(ELEVATOR, half=2.0 * state.settings.tightness))
    assert baseline(state)


def test_what_is_flown_has_margins_at_every_corner(state: controller.ControllerState) -> None:
    estimates = beliefs({**ELEVATOR, "Cm_alpha": -0.3}, half=0.1)
    flown(state, 4.0, estimates)
    for axis in state.axes:
        assert axis.accepted > 0
        values = np.array([estimates[name].value for name in axis.axis.derivatives])
        half = np.array([0.5 * (estimates[n].upper - estimates[n].lower) for n in axis.axis.derivatives])
        corners = region_points(values, half, axis.axis.signals, None).values
        found = margins(axis.axis.model(corners), axis.target.gains, axis.axis.delay)
        assert found.enough(2.0, math.pi / 4.0).all()


def test_wide_corners_ask_for_caution(state: controller.ControllerState) -> None:
    flown(state, 3.0, beliefs(half=0.35))
    assert "caution" in state.axes[0].verdict or "kept" in state.axes[0].verdict


#: What was identified of a cdrw with its centre of gravity aft, in flight: value, half of the 95 % interval.
UNSTABLE = {
    "CL_alpha": (2.556, 0.619),
    "CL_de": (0.941, 0.282),
    "Cm_alpha": (0.075, 0.053),
    "Cm_q": (-0.484, 0.188),
    "Cm_de": (-0.336, 0.059),
}
#: The correlation of these errors.
TOGETHER = np.array(
    [
        [1.0, -0.33, 0.21, -0.27, -0.29],
        [-0.33, 1.0, -0.02, -0.13, -0.37],
        [0.21, -0.02, 1.0, 0.04, -0.10],
        [-0.27, -0.13, 0.04, 1.0, 0.60],
        [-0.29, -0.37, -0.10, 0.60, 1.0],
    ]
)


def unstable() -> dict[str, IdentifiedDerivative]:
    return {name: IdentifiedDerivative(v, v - h, v + h, True, 1.0) for name, (v, h) in UNSTABLE.items()}


@pytest.mark.slow
def test_an_unstable_aircraft_is_adapted_to_where_it_is_known_how_errors_go_together() -> None:
    """The corners of five separate intervals are 4.4 standard errors away, where nothing can be flown with margins."""
    separate, joint = controller.init(AIRCRAFT, ControllerSettings()), _adapted_to_the_unstable()
    flown(separate, 6.0, unstable())
    assert separate.axes[0].verdict == "kept: no margins within the intervals"
    assert joint.axes[0].verdict == "adapted, caution 4"


def test_between_the_points_of_the_region_margins_are_kept_too() -> None:
    """2000 errors drawn from their distribution: over 95 % keep 6 dB and 45 deg, and all are stable."""
    state = _adapted_to_the_unstable()
    axis, errors = state.axes[0].axis, np.array([half for _, half in UNSTABLE.values()]) / 1.96
    drawn = np.random.default_rng(1).multivariate_normal(np.zeros(5), TOGETHER * np.outer(errors, errors), 2000)
    values = np.tile(state.axes[0].target.values, (2000, 1))
    values[:, [axis.derivatives.index(name) for name in UNSTABLE]] += drawn
    found = margins(axis.model(values), state.axes[0].target.gains, axis.delay)
    assert found.enough(2.0, math.pi / 4.0).mean() > 0.95
    assert found.stable.all()


@pytest.mark.parametrize(("half_of_alpha", "verdict"), [(1e-6, "adapted"), (0.5, "kept: no margins within the")])
def test_gains_are_not_flown_where_the_joint_errors_may_leave_no_stability(half_of_alpha: float, verdict: str) -> None:
    """A steady deflection is reversed where Cm_de CL_alpha = Cm_alpha CL_de, at -0.098: beyond this interval of Cm_de.

    Where CL_alpha is uncertain, too, both together reach 1.25 times as far with 95 %.
    """
    known = {"CL_alpha": (3.026, half_of_alpha), "Cm_alpha": (-0.262, 1e-6), "Cm_de": (-0.267, 0.155)}
    state = controller.init(AIRCRAFT, ControllerSettings(gain_margin=1.0, phase_margin=0.0))
    controller.receive_correlation(state, ErrorCorrelation(tuple(known), np.eye(3)))
    flown(state, 4.0, {n: IdentifiedDerivative(v, v - h, v + h, True, 1.0) for n, (v, h) in known.items()})
    assert state.axes[0].verdict.startswith(verdict)


def test_what_is_known_of_some_errors_only_leaves_the_intervals() -> None:
    state = controller.init(AIRCRAFT, ControllerSettings())
    controller.receive_correlation(state, ErrorCorrelation(tuple(UNSTABLE)[1:], TOGETHER[1:, 1:]))
    flown(state, 6.0, unstable())
    assert state.axes[0].verdict == "kept: no margins within the intervals"


@pytest.mark.parametrize("share", [0.05, 0.0, -0.5])
def test_surfaces_without_effect_or_reversed_are_not_relied_on(state: controller.ControllerState, share: float) -> None:
    flown(state, 3.0, beliefs({"Cm_de": share}, half=0.02))
    np.testing.assert_allclose(state.axes[0].flown.gains, state.axes[0].axis.baseline)
    assert "hardly any effect" in state.axes[0].verdict


@pytest.mark.parametrize("share", [0.1, -0.2])
def test_a_lift_slope_that_would_turn_a_steady_deflection_round_is_not_relied_on(
    state: controller.ControllerState, share: float
) -> None:
    """Pitch follows the elevator by Cm_de CL_alpha - Cm_alpha CL_de in the end (Cramer): of the other sign here."""
    d = {name: derivative.value for name, derivative in AIRCRAFT.derivatives.items()}
    assert d["Cm_de"] * d["CL_alpha"] - d["Cm_alpha"] * d["CL_de"] < 0.0
    assert d["Cm_de"] * share * d["CL_alpha"] - d["Cm_alpha"] * d["CL_de"] > 0.0
    flown(state, 3.0, beliefs({"CL_alpha": share}, half=0.02))
    np.testing.assert_allclose(state.axes[0].flown.gains, state.axes[0].axis.baseline)
    assert "the opposite" in state.axes[0].verdict


def test_no_margins_at_the_corners_keeps_what_is_flown() -> None:
    strict = controller.init(AIRCRAFT, ControllerSettings(gain_margin=6.0, phase_margin=1.2))
    flown(strict, 3.0, beliefs(ELEVATOR, half=0.35))
    assert strict.axes[0].refused > 0
    assert "no margins" in strict.axes[0].verdict
    np.testing.assert_allclose(strict.axes[0].flown.gains, strict.axes[0].axis.baseline)


def test_gains_move_at_a_bounded_rate(state: controller.ControllerState) -> None:
    pitch, last, fastest = state.axes[0], state.axes[0].flown.gains, 0.0
    estimates = beliefs(ELEVATOR, half=0.02)
    for k in range(800):
        if k % 10 == 0:
            controller.receive_estimates(state, k * STEP, estimates)
        controller.step(state, level(k * STEP), SetPoints())
        fastest = max(fastest, float(np.abs(pitch.flown.gains - last).max() / np.abs(pitch.axis.baseline).max()))
        last = pitch.flown.gains
    assert not baseline(state)
    assert 0.0 < fastest <= state.settings.gain_rate * STEP * 1.001


def test_old_estimates_bring_the_baseline_back() -> None:
    state, end = weakened()
    assert not baseline(state)
    flown(state, 0.2, None, end)
    assert state.stale == ""
    flown(state, 0.25, None, end + 0.2)
    assert "no estimates for" in state.stale
    assert baseline(state), "within half a second"


def test_after_a_short_lapse_what_was_flown_is_taken_up_again() -> None:
    """Also where no estimate is fit for use any more, because nothing excites the aircraft."""
    state, end = weakened()
    adapted = state.axes[0].flown.gains
    end = flown(state, 1.0, None, end)
    assert not np.allclose(state.axes[0].flown.gains, adapted)
    flown(state, 3.0, beliefs(ELEVATOR, r_squared=0.0), end)
    np.testing.assert_allclose(state.axes[0].flown.gains, adapted)


def test_after_a_long_one_it_is_not() -> None:
    state, end = weakened()
    end = flown(state, 8.0, None, end)
    flown(state, 3.0, beliefs(ELEVATOR, r_squared=0.0), end)
    assert baseline(state)


def test_a_silent_sensor_brings_the_baseline_back() -> None:
    state, end = weakened()
    for k in range(1200):
        controller.step(state, level(end + k * STEP, alpha=NAN), SetPoints())
    assert state.stale == "alpha not measured"
    assert baseline(state)


def test_the_clock_may_step_back(state: controller.ControllerState) -> None:
    flown(state, 0.5, beliefs(half=0.02), 100.0)
    flown(state, 5.0, beliefs(ELEVATOR, half=0.02), 3.0)
    np.testing.assert_allclose(state.axes[0].flown.gains[0, 1], 2.5 * state.axes[0].axis.baseline[0, 1], rtol=0.01)
    assert len(state.law.surfaces.pending) < 10
    assert len(state.law.behind.pending) < 10


def test_adaptation_can_be_switched_off() -> None:
    fixed = controller.init(AIRCRAFT, ControllerSettings(adapt=False))
    flown(fixed, 3.0, beliefs(ELEVATOR, half=0.02))
    assert baseline(fixed)


def test_impossible_settings_are_refused() -> None:
    with pytest.raises(InputError, match="gain_margin"):
        ControllerSettings(gain_margin=0.5)
    with pytest.raises(InputError, match="delay"):
        ControllerSettings(delay=NAN)


def test_slow_actuators_are_refused() -> None:
    with pytest.raises(InputError, match="too slow"):
        controller.init(AIRCRAFT, ControllerSettings(actuator_lag=1.0, delay=0.5))
