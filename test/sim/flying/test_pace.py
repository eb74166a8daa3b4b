"""The number of samples that are due, by clocks that the test sets."""

import pytest

from sysid_node.sim.flying.pace import AT_ONCE, MOST_BEHIND, Pace

STEP = 0.005


def flown(pace: Pace, samples: int, begin: float, end: float, every: float = 0.0025) -> tuple[int, int]:
    """Calls from ``begin`` to ``end`` (s): samples in all, and the most of one call."""
    most = 0
    for k in range(round((end - begin) / every) + 1):
        due = pace.due(begin + k * every, samples)
        samples, most = samples + due, max(most, due)
    return samples, most


@pytest.mark.parametrize("speed", [1.0, 2.0, 0.5])
def test_on_time_it_flies_as_fast_as_it_should(speed: float) -> None:
    pace = Pace(100.0, STEP, speed)
    samples, most = flown(pace, 0, 100.0, 110.0)
    assert samples == pytest.approx(10.0 * speed / STEP, abs=1)
    assert most <= 2
    assert pace.skipped == 0.0


def test_a_short_pause_is_made_up_for_in_small_pieces() -> None:
    pace = Pace(0.0, STEP)
    samples, _ = flown(pace, 0, 0.0, 1.0)
    later, most = flown(pace, samples, 1.0 + 0.8 * MOST_BEHIND, 2.0)
    assert later == pytest.approx(2.0 / STEP, abs=1)
    assert most == round(AT_ONCE / STEP)
    assert pace.skipped == 0.0


def test_the_rest_of_a_long_pause_is_skipped() -> None:
    """One call never asks for more than a few samples, however long the pause was."""
    pace = Pace(0.0, STEP)
    samples, _ = flown(pace, 0, 0.0, 1.0)
    later, most = flown(pace, samples, 4.0, 5.0)
    assert most == round(AT_ONCE / STEP)
    assert pace.skipped == pytest.approx(3.0 - MOST_BEHIND, abs=2 * STEP)
    assert later == pytest.approx((5.0 - pace.skipped) / STEP, abs=1)


def test_a_machine_that_is_always_too_slow_flies_slower() -> None:
    """With ten calls a second the flight takes five times as long, and the delay stays bounded."""
    pace = Pace(0.0, STEP)
    samples, most = flown(pace, 0, 0.0, 10.0, every=0.1)
    assert most == round(AT_ONCE / STEP)
    assert samples == pytest.approx(0.2 * 10.0 / STEP, rel=0.05)
    assert pace.skipped == pytest.approx(8.0, abs=0.3)


def test_the_largest_delay_is_reported_once() -> None:
    """The largest delay since the last call, by the real clock, at any speed."""
    pace = Pace(0.0, STEP, 2.0)
    samples, _ = flown(pace, 0, 0.0, 1.0)
    assert pace.tell() <= STEP
    samples, _ = flown(pace, samples, 1.05, 2.0)
    assert pace.tell() == pytest.approx(0.05, abs=STEP)
    flown(pace, samples, 2.0025, 3.0)
    assert pace.tell() <= STEP
