"""The time of flight by stamps. Truth: seconds that were flown, whatever the clock was set to meanwhile."""

import pytest

from sysid_node.flight.live.flight_time import FlightTime

SECOND = 1_000_000_000
HOUR = 3600 * SECOND


def test_it_counts_from_the_first_stamp() -> None:
    time = FlightTime()
    assert time.arrived(1_700_000_000 * SECOND)
    assert time.seconds == 0.0
    assert time.arrived(1_700_000_000 * SECOND + SECOND // 2)
    assert time.seconds == 0.5


@pytest.mark.parametrize("leap", [-HOUR, HOUR])
def test_a_clock_that_is_set_adds_nothing(leap: int) -> None:
    time = FlightTime()
    for stamp in (HOUR, HOUR + SECOND // 4, HOUR + leap, HOUR + leap + SECOND // 4):
        assert time.arrived(stamp)
    assert time.seconds == 0.5


def test_an_older_message_is_left_out() -> None:
    time = FlightTime()
    for stamp, newer in (
        (5 * SECOND, True),
        (5 * SECOND + 20, True),
        (5 * SECOND + 10, False),
        (5 * SECOND + 20, False),
        (5 * SECOND + 30, True),
    ):
        assert time.arrived(stamp) == newer
    assert time.seconds == pytest.approx(3e-8)
