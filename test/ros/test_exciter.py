"""The exciter among messages of an aircraft that is not there: its answers, and clocks that are set."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Quaternion, Vector3
from harness import START_NS, Probe, ended, start
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from sysid_msgs.msg import DerivativeEstimates

from sysid_node.faults.types import LOSS
from sysid_node.ros.support import conversion

HOUR = 3600 * 10**9


class Flyer:
    """Says that the aircraft is in level flight, and hears the excitation."""

    def __init__(self, probe: Probe) -> None:
        self.probe = probe
        self.excitation: list[Any] = []
        self.stamp = START_NS
        self.heard = probe.node.create_subscription(JointState, "actuators/excitation", self.excitation.append, 1000)
        self.start = probe.node.create_client(Trigger, "exciter/start")

    def until(self, condition: Callable[[], Any], patience: float = 60.0) -> None:
        """Fly until the condition holds."""
        end = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < end
            self.stamp += 20_000_000
            force, header = Vector3(z=9.81), conversion.header(self.stamp, "base_link")
            self.probe.imu.publish(Imu(header=header, orientation=Quaternion(w=1.0), linear_acceleration=force))
            self.probe.say_air_data(self.stamp, (18.0, 0.05, 0.0, 1.2))
            self.probe.spin(0.02)

    def begin(self, words: str = "", patience: float = 60.0) -> None:
        """Ask until the excitation begins, and the answer holds the words: at first the exciter may not have heard all.

        One that has begun with another answer is stopped.
        """
        end = time.monotonic() + patience
        while not (answer := self._ask()).success or words not in answer.message:
            assert time.monotonic() < end, answer.message
            assert self.probe.ask(Trigger, "exciter/stop").success

    def _ask(self) -> Any:
        """The exciter's answer to one request."""
        future = self.start.call_async(Trigger.Request())
        self.until(future.done)
        return future.result()


@pytest.mark.slow
def test_excitation_goes_on_where_the_clock_is_set(probe: Probe) -> None:
    """It had held the first deflection of the manoeuvre until the clock was where it had been."""
    flyer = Flyer(probe)
    with ended(start("exciter", "--ros-args", "-p", "aircraft:=cdrw")):
        flyer.until(lambda: flyer.start.service_is_ready() and len(flyer.excitation) > 50)
        flyer.begin()
        for leap in (-HOUR, 2 * HOUR):
            flyer.until(lambda: any(np.any(message.position) for message in flyer.excitation))
            flyer.stamp += leap
            for count in (50, 150):  # the first of them were sent before
                flyer.excitation.clear()
                flyer.until(lambda wanted=count: len(flyer.excitation) > wanted)
            moved = np.array([message.position for message in flyer.excitation])
            assert (np.ptp(moved, axis=0) > 0.002).all(), leap


@pytest.mark.slow
def test_it_refuses_what_it_would_abort_and_says_that_nobody_can_begin_estimates_anew(probe: Probe) -> None:
    """Without sensors it had answered that it excites, and aborted a hundredth of a second later.

    After a fault the estimates have to begin anew, for which the identifier has a service.
    """
    flyer = Flyer(probe)
    said: list[str] = []
    estimates = probe.node.create_publisher(DerivativeEstimates, "identifier/derivatives", 10)
    faults = probe.node.create_publisher(DiagnosticArray, "fault_monitor/faults", 10)
    values = [KeyValue(key="part", value="elevator"), KeyValue(key="kind", value=LOSS)]
    with ended(start("exciter", "--ros-args", "-p", "aircraft:=cdrw", "-p", "watch:=true"), said):
        answer = probe.ask(Trigger, "exciter/start")
        assert (answer.success, answer.message) == (
            False,
            "/imu/data: no message yet; excitation needs the attitude and the load factor",
        )
        assert probe.ask(Trigger, "exciter/stop").success
        heard = (estimates.get_subscription_count, faults.get_subscription_count)
        flyer.until(lambda: flyer.start.service_is_ready() and all(count() for count in heard))
        flyer.begin()
        flyer.until(lambda: any(np.any(message.position) for message in flyer.excitation))
        faults.publish(DiagnosticArray(status=[DiagnosticStatus(values=values)]))
        begun = flyer.stamp
        for later in range(1, 12):
            flyer.until(lambda wanted=begun + later * 200_000_000: flyer.stamp > wanted)
            estimates.publish(DerivativeEstimates(header=conversion.header(flyer.stamp, ""), aircraft="cdrw"))
        probe.node.destroy_subscription(flyer.heard)
        flyer.begin("; nobody listens to /actuators/excitation, so no surface will move")
    assert "estimates begun anew" in said[0]
    assert said[0].count("/identifier/reset: nobody offers this service") == 1
