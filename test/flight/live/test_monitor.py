"""What is counted of a topic's messages, by a clock of the test's own."""

import math

from sysid_node.flight.live.monitor import TopicMonitor


def test_a_wait_that_begins_anew_forgets_the_silence_before() -> None:
    """A node that did not listen for a minute is not told of a minute of silence."""
    now = [0.0]
    monitor = TopicMonitor("imu/data", lambda: now[0])
    assert math.isnan(monitor.silence())
    now[0] = 5.0
    assert monitor.waited() == 5.0
    monitor.arrived()
    now[0] = 65.0
    assert (monitor.silence(), monitor.waited()) == (60.0, 60.0)
    monitor.begin()
    now[0] = 66.0
    assert (monitor.silence(), monitor.waited(), monitor.rate()) == (1.0, 1.0, 1.0)
    monitor.arrived()
    assert (monitor.silence(), monitor.waited()) == (0.0, 0.0)
