"""What ``sysid loop`` makes of the nodes' words."""

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from sysid_node.ros.support.loop_watch import MONITOR, LoopWatch


@pytest.mark.parametrize(
    ("said", "news"),
    [
        ("learns what sound flight is like; /imu/data: no message yet", "learns what sound flight is like"),
        (
            "nothing has failed; /imu/data: no message yet: nobody publishes it, but x is on /a: remap it?",
            "nothing has failed",
        ),
        ("elevator: loss of effectiveness, 58 % (49 % to 67 %)", "elevator: loss of effectiveness"),
        ("imu/data: sensor silent, 2.1 s; /uav1/imu/data: no message for 2.1 s", "imu/data: sensor silent"),
    ],
)
def test_a_silent_topic_is_not_reported_as_a_fault(ros: None, said: str, news: str) -> None:
    watch = LoopWatch()
    try:
        watch.words[MONITOR] = DiagnosticStatus(message=said)
        assert watch.news()[MONITOR] == news
    finally:
        watch.close()
