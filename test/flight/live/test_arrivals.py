"""Problems in the arrival of messages, by a clock that the tests set."""

import random

import pytest

from sysid_node.flight.live.arrivals import Arrivals


class Clock:
    """A clock that the tests set, s."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def fed(clock: Clock, topic: Arrivals, seconds: float, *, drop: float = 0.0, jitter: float = 0.0) -> None:
    """Messages at 100 Hz, of which some are lost and each is late by up to ``jitter`` s."""
    draw = random.Random(1)
    begin = clock.now
    for k in range(round(seconds * 100)):
        clock.now = max(clock.now, begin + 0.01 * k + draw.random() * jitter)
        if draw.random() >= drop:
            topic.arrived(1000.0 + begin + 0.01 * k)


def test_all_is_well(clock: Clock) -> None:
    topic = Arrivals("imu/data", 0.1, clock)
    fed(clock, topic, 3.0)
    assert topic.troubles() == []
    assert topic.count == 0


def test_losses_are_told_once(clock: Clock) -> None:
    topic = Arrivals("imu/data", 0.2, clock)
    fed(clock, topic, 20.0, drop=0.3)
    (words,) = topic.troubles()
    assert words.startswith("imu/data")
    assert float(words.split()[1]) == pytest.approx(30.0, abs=4.0)
    assert topic.troubles() == []


def test_an_interval_that_was_short_once_is_not_usual(clock: Clock) -> None:
    """Nor is a rate that was higher before: what is usual follows."""
    topic = Arrivals("identifier/derivatives", 1.0, clock)
    stamp = 1000.0
    for k in range(400):
        step = 0.01 if k in (30, 31) else 0.025 if k < 200 else 0.05
        stamp, clock.now = stamp + step, clock.now + step
        topic.arrived(stamp)
        said = topic.troubles() if k % 100 == 99 else []
    assert said == []


def test_what_comes_late(clock: Clock) -> None:
    topic = Arrivals("imu/data", 0.2, clock)
    fed(clock, topic, 2.0)
    topic.troubles()
    fed(clock, topic, 2.0, jitter=0.05)
    assert any("ms late" in words for words in topic.troubles())


def test_a_sender_that_has_lost_time_is_not_late_for_ever(clock: Clock) -> None:
    """Its stamps fall behind by 2 s once, as a simulator's do that could not keep up."""
    topic = Arrivals("imu/data", 0.2, clock)
    fed(clock, topic, 8.0)
    topic.troubles()
    for k in range(2000):
        clock.now += 0.01
        topic.arrived(1108.01 + 0.01 * k)
        if k == 50:
            clock.now += 2.0
        if k % 100 == 99:
            said = topic.troubles()
    assert said == []


def test_a_short_silence_is_told_after_it_has_ended(clock: Clock) -> None:
    topic = Arrivals("air_data", 0.1, clock)
    assert not topic.silent()  # nothing was ever heard
    fed(clock, topic, 1.0)
    clock.now += 0.4
    assert topic.silent()
    assert topic.arrived(1000.0 + clock.now)
    assert "air_data was silent for 0.4 s" in topic.troubles()


def test_a_clock_that_steps_back(clock: Clock) -> None:
    topic = Arrivals("imu/data", 0.1, clock)
    fed(clock, topic, 1.0)
    newest = topic.stamp
    assert not topic.arrived(newest - 0.2)
    assert topic.arrived(newest - 5.0)
    assert topic.troubles() == ["imu/data out of order", "imu/data clock set by -5.0 s"]
    assert topic.count == 2


def test_messages_whose_stamps_stand_still_end_no_silence(clock: Clock) -> None:
    """They had counted as heard: nothing was done with them, nor was the topic silent."""
    topic = Arrivals("imu/data", 0.1, clock)
    fed(clock, topic, 1.0)
    newest = topic.stamp
    for _ in range(20):
        clock.now += 0.01
        assert not topic.arrived(newest)
    assert topic.silent()
    assert topic.troubles() == ["imu/data out of order", "imu/data silent for 0.2 s"]
    assert topic.arrived(newest + 0.21)
    assert topic.troubles() == ["imu/data was silent for 0.2 s"]


@pytest.mark.parametrize("pace", [1.0, 10.0])
def test_a_silence_is_no_clock_that_was_set(clock: Clock, pace: float) -> None:
    """The sender goes on after 8 s, its stamps as far ahead as its clock has run; a simulation's may run faster."""
    topic = Arrivals("imu/data", 0.1, clock)
    for k in range(300):
        clock.now += 0.01
        topic.arrived(1000.0 + 0.01 * pace * k)
    clock.now += 8.0
    topic.arrived(1000.0 + pace * (3.0 + 8.0))
    assert topic.troubles() == ["imu/data was silent for 8.0 s"]
    clock.now += 0.01
    topic.arrived(topic.stamp + 60.0)
    assert topic.troubles() == ["imu/data clock set by +60.0 s"]
