"""A tracking error that the law cannot mean is said, then the baseline is flown, until the error was small for long."""

import pytest
from flying import AIRCRAFT, LEVEL, beliefs, level

from sysid_node.control import controller
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import SetPoints

STEP = 0.02  # s


def fly(state: controller.ControllerState, start: float, seconds: float, **changes: float) -> float:
    """Steps of constant measurements with fresh estimates of a weak elevator; the time after them."""
    for k in range(round(seconds / STEP)):
        now = start + k * STEP
        controller.receive_estimates(state, now, beliefs({"Cm_de": 0.6}))
        controller.step(state, level(now, **changes), SetPoints())
    return start + seconds


@pytest.mark.slow
def test_a_large_tracking_error_is_said_then_the_baseline_is_flown() -> None:
    state = controller.init(AIRCRAFT, ControllerSettings(largest_tracking_error=0.5))
    now = fly(state, 0.0, 4.0)
    assert state.axes[0].verdict == "adapted"
    assert state.tracking.words == ""

    now = fly(state, now, 0.3, theta=LEVEL + 0.7)
    assert state.tracking.words.startswith("pitch is 0.7")
    assert state.axes[0].verdict == "adapted", "it may be a gust"

    now = fly(state, now, 1.5, theta=LEVEL + 0.7)
    assert state.axes[0].verdict == "baseline: the tracking error was over 0.5 rad"
    assert (state.axes[0].flown.gains == state.axes[0].axis.baseline).all()

    now = fly(state, now, 3.0)
    assert state.axes[0].verdict.startswith("baseline"), "not at once again"
    fly(state, now, 5.0)
    assert state.axes[0].verdict == "adapted", "by estimates that have come since"
