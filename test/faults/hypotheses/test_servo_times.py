"""Servos that become slower, by the identifier's estimates. Truth: known steps, and scatter of the stated size."""

import math

import numpy as np
import pytest

from sysid_node.faults.hypotheses import servo_times
from sysid_node.faults.hypotheses.servo_times import ServoTimes
from sysid_node.faults.model.reference_model import IdentifierEstimate
from sysid_node.faults.types import ESTIMATES, SLOWER

PERIOD = 0.5  # s between estimates
SOUND, SLOW = (0.020, 0.003, True), (0.100, 0.010, True)


def heard(
    before: list[tuple[float, float, bool]], after: list[tuple[float, float, bool]], *, announced: bool = True
) -> ServoTimes:
    """The comparison after estimates of the elevator's servo: how late (s), standard error (s), valid.

    The first of those ``after`` are announced as a change for 1 s, as the identifier does it.
    """
    state = ServoTimes()
    for k, estimate in enumerate([*before, *after]):
        changed = announced and 0 <= k - len(before) < 2
        servo_times.receive(state, k * PERIOD, {"elevator": IdentifierEstimate(*estimate)}, changed)
    return state


def test_a_step_is_found_with_its_size_and_interval() -> None:
    (fault,) = heard([SOUND] * 10, [SLOW] * 4).faults
    error = math.hypot(0.003, 0.010)
    assert (fault.kind, fault.part, fault.unit, fault.source) == (SLOWER, "elevator", "s", ESTIMATES)
    assert fault.size == pytest.approx(0.080)
    assert (fault.lower, fault.upper) == pytest.approx((0.080 - 1.96 * error, 0.080 + 1.96 * error))
    assert fault.since == pytest.approx(2.5)  # the change was announced at 5 s, up to 2 s late
    assert fault.found == pytest.approx(5.0 + servo_times.LASTING)
    assert fault.text == "elevator: servo slower, 0.08 s (0.0595 s to 0.1 s)"


def test_what_began_before_the_announcement_is_not_compared_with() -> None:
    """The estimates of the last two seconds before it may hold the change already."""
    (fault,) = heard([SOUND] * 10 + [(0.060, 0.003, True)] * 3, [SLOW] * 4).faults
    assert fault.size == pytest.approx(0.080)


def test_it_ends_when_the_servo_is_no_longer_surely_slower() -> None:
    assert heard([SOUND] * 10, [SLOW] * 4 + [(0.022, 0.004, True)]).faults == []


def test_a_second_change_does_not_make_the_slow_servo_usual() -> None:
    state = heard([SOUND] * 10, [SLOW] * 20)
    servo_times.receive(state, 20.0, {}, True)
    servo_times.receive(state, 22.0, {"elevator": IdentifierEstimate(*SLOW)}, False)
    assert [fault.size for fault in state.faults] == [pytest.approx(0.080)]


@pytest.mark.parametrize(
    "later",
    [
        (0.030, 0.001, True),  # 10 ms: of no interest
        (0.060, 0.012, True),  # 3.2 standard errors
        (0.100, 0.010, False),  # not valid
        (0.001, 0.002, True),  # faster
        (math.nan, 0.002, True),
        (0.100, math.inf, True),
    ],
)
def test_what_is_no_fault(later: tuple[float, float, bool]) -> None:
    assert heard([SOUND] * 10, [later] * 6).faults == []


def test_without_an_announced_change_nothing_is_compared() -> None:
    assert heard([SOUND] * 10, [SLOW] * 6, announced=False).faults == []


def test_one_estimate_is_not_enough() -> None:
    assert heard([SOUND] * 10, [SLOW, SLOW, SOUND, SLOW]).faults == []


def test_estimates_that_scatter_as_they_say_raise_nothing() -> None:
    """400 servos with 60 independent estimates after a change of something else."""
    random = np.random.default_rng(1)
    errors = 0.02 / np.sqrt(1.0 + np.arange(60) / 10.0)
    for _ in range(400):
        drawn = 0.03 + errors * random.standard_normal(60)
        after = [(float(x), float(e), True) for x, e in zip(drawn, errors, strict=True)]
        before = (0.03 + 0.004 * random.standard_normal(), 0.004, True)
        assert heard([before] * 6, after).faults == []
