"""The flight simulator beside another that publishes /clock: truth is which clocks there are."""

import pytest
from harness import Probe, ended, start
from rosgraph_msgs.msg import Clock


@pytest.mark.slow
def test_a_second_clock_is_said(probe: Probe) -> None:
    """All nodes with use_sim_time would hear the times of both flights by turns."""
    said: list[str] = []
    simulator = start("flight_simulator", "--ros-args", "-p", "aircraft:=cdrw", "-p", "rate:=20.0", "-p", "speed:=2.0")
    with ended(simulator, said):
        probe.until(lambda: "flown" in state(probe), patience=60.0)
        assert "/clock" not in state(probe)
        other = probe.node.create_publisher(Clock, "/clock", 10)
        try:
            probe.until(lambda: "/clock: 2 nodes publish it" in state(probe))
        finally:
            probe.node.destroy_publisher(other)
        probe.until(lambda: "/clock" not in state(probe))
    assert "own ROS_DOMAIN_ID" in said[0]


def state(probe: Probe) -> str:
    """What /diagnostics says of the simulator."""
    status = probe.diagnostics.get("flight_simulator: state")
    return status.message if status else ""
