"""An exception in the middle of a flight: said on /diagnostics, and the node can be started again."""

from collections.abc import Iterator
from threading import Thread

import pytest
from harness import Probe, made_up_streams
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from sysid_node.online.session import UNTOLD, Due, Session
from sysid_node.ros.identifier import Identifier


class FaultySession(Session):
    """A session that divides by zero while ``fails`` is set."""

    fails = False

    def imu(self, stamp_ns: int, values: tuple[float, ...], tilt: tuple[float, float] = UNTOLD) -> list[Due]:
        if self.fails:
            return [1 / 0]  # type: ignore[list-item]
        return super().imu(stamp_ns, values, tilt)


@pytest.fixture
def node(ros: None) -> Iterator[Identifier]:
    """An active identifier, served by a thread of this process."""
    one = Identifier(FaultySession)
    one.set_parameters([Parameter("aircraft", value="cdrw")])
    one.trigger_configure()
    one.trigger_activate()
    executor = SingleThreadedExecutor()
    executor.add_node(one)
    thread = Thread(target=executor.spin)
    thread.start()
    yield one
    executor.shutdown()
    thread.join()
    one.destroy_node()


@pytest.mark.slow
def test_it_says_so_and_flies_again(node: Identifier, probe: Probe) -> None:
    probe.await_identifier()
    FaultySession.fails = True
    probe.speak(made_up_streams(0.1))
    probe.until(lambda: probe.said("state", "state") == "unconfigured")
    FaultySession.fails = False
    assert probe.said("state", "last fault") == "on_message: ZeroDivisionError: division by zero"
    assert probe.diagnostics["identifier: state"].level == b"\x02"
    assert not probe.estimates
    node.trigger_configure()
    node.trigger_activate()
    probe.await_identifier()
    probe.speak(made_up_streams(2.0))
    probe.until(lambda: probe.estimates)
    probe.until(lambda: probe.said("state", "state") == "active")
    assert probe.diagnostics["identifier: state"].level == b"\x00"
    assert probe.said("state", "exceptions in callbacks") == "1"


class UnfinishedSession:
    """A session without settings: what is made of it next fails."""

    def __init__(self, *_: object) -> None:
        pass


def test_a_configuration_that_fails_half_way_can_be_begun_anew(ros: None) -> None:
    one = Identifier(UnfinishedSession)  # type: ignore[arg-type]
    try:
        one.set_parameters([Parameter("aircraft", value="cdrw")])
        one.trigger_configure()
        assert one.state_label == "unconfigured"
        assert "AttributeError" in one.fault
        one.trigger_configure()
        assert one.state_label == "unconfigured"
    finally:
        one.destroy_node()
