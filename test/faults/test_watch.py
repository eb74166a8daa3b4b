"""Messages to faults: what is silent, what does not follow its command; the clock is the test's own."""

import math
from dataclasses import replace

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.faults import watch as watching
from sysid_node.faults.model.reference_model import IdentifierEstimates, identifier_estimates
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import ARRIVAL, ESTIMATES, FORCES, LOSS, POSITION, SILENT, SLOWER, STUCK, Fault
from sysid_node.faults.watch import Announcements, MessageWatch
from sysid_node.online.types import DerivativeEstimate

AIRCRAFT = load_aircraft("cdrw")
JOINTS = ("throttle", "elevator", "aileron", "rudder")
START_NS = 1_700_000_000_000_000_000
STEP = 0.01  # s


def elevator(time: float) -> float:
    return 0.1 * math.sin(3.0 * time)


def flown(
    watch: MessageWatch, begin: float, end: float, *, silent: str = "", stuck: bool = False, stamped: bool = True
) -> None:
    """Level flight from ``begin`` to ``end`` (s) while the elevator moves, its positions behind a servo's lag."""
    for k in range(round(begin / STEP), round(end / STEP)):
        now = k * STEP
        stamp = START_NS + round(1e9 * now)
        told = (0.3, elevator(now), 0.0, 0.0)
        place = 0.06 if stuck else elevator(now - 0.05)
        watching.on_command(watch, stamp if stamped else 0, JOINTS, told)
        if silent != "imu/data":
            watching.on_imu(watch, now, stamp, (0.1, 0.0, -9.8, 0.0, 0.0, 0.0))
        if silent != "air_data":
            watching.on_air_data(watch, now, stamp, (18.0, 0.07, 0.0, 1.2))
        if silent != "actuators":
            watching.on_actuators(watch, now, stamp, JOINTS, (0.3, place, 0.0, 0.0))


@pytest.fixture
def watch() -> MessageWatch:
    return watching.init(AIRCRAFT, FaultMonitorSettings(), watching.STALE_AFTER)


def only(faults: list[Fault]) -> Fault:
    (fault,) = faults
    return fault


@pytest.mark.parametrize("topic", ["imu/data", "air_data", "actuators"])
def test_a_silent_topic_is_said_until_it_speaks_again(watch: MessageWatch, topic: str) -> None:
    flown(watch, 0.0, 2.0)
    assert watching.present_faults(watch, 2.0) == []
    flown(watch, 2.0, 3.0, silent=topic)
    fault = only(watching.present_faults(watch, 3.0))
    assert (fault.kind, fault.part, fault.source) == (SILENT, topic, ARRIVAL)
    assert fault.size == pytest.approx(1.01, abs=1e-9)  # its last message came at 1.99 s
    assert fault.since == pytest.approx(1.99, abs=2 * STEP)
    assert fault.found == pytest.approx(fault.since + 0.5)
    flown(watch, 3.0, 3.1)
    assert watching.present_faults(watch, 3.1) == []


def test_what_never_spoke_is_not_silent(watch: MessageWatch) -> None:
    flown(watch, 0.0, 2.0, silent="air_data")
    assert watching.present_faults(watch, 2.0) == []


def test_a_fault_that_was_found_stands_while_a_topic_is_silent(watch: MessageWatch) -> None:
    """It had vanished, and was announced anew when the topic came back."""
    flown(watch, 0.0, 2.0)
    watch.state.fault = Fault(LOSS, "elevator", 0.5, 0.4, 0.6, "", 1.0, 1.5, 1.0)
    flown(watch, 2.0, 3.0, silent="actuators")
    assert [fault.kind for fault in watching.present_faults(watch, 3.0)] == [SILENT, LOSS]


@pytest.mark.parametrize("stamped", [True, False])
def test_a_jammed_servo_by_the_samples_clock(watch: MessageWatch, stamped: bool) -> None:
    """Its times count from the first IMU message, as those of all faults do."""
    flown(watch, 0.0, 2.0, stamped=stamped)
    assert watching.present_faults(watch, 2.0) == []
    flown(watch, 2.0, 4.0, stuck=True, stamped=stamped)
    fault = only(watching.present_faults(watch, 4.0))
    assert (fault.kind, fault.part, fault.source) == (STUCK, "elevator", POSITION)
    assert 2.0 <= fault.since <= fault.found <= 4.0


def test_it_says_what_is_news_and_repeats_it_once_a_second() -> None:
    jam = Fault(STUCK, "elevator", 0.1, math.nan, math.nan, "rad", 1.0, 1.5, 1.0)
    speech = Announcements()
    said = [k for k in range(40) if speech.due([jam] if k >= 15 else [], 0.1 * k)]
    assert said == [0, 10, 15, 25, 35]


def test_a_servo_that_is_slower_after_a_change_is_among_the_faults(watch: MessageWatch) -> None:
    """From the identifier's estimates as a message or a replay holds them: 20 ms before the change, 100 ms after it."""

    def estimated(late: float, status: str) -> IdentifierEstimates:
        servo = DerivativeEstimate("elevator", late, 0.004, late - 0.008, late + 0.008, True, "ok")
        return identifier_estimates([DerivativeEstimate("Cm_de", -1.0, 0.1, -1.2, -0.8, False, status)], [servo])

    for second in range(9):
        flown(watch, second, second + 1.0)
        status = "changed" if second == 5 else "ok"
        watching.on_estimates(watch, estimated(0.02 if second < 5 else 0.1, status))
    fault = only(watching.present_faults(watch, 9.0))
    assert (fault.kind, fault.part, fault.source) == (SLOWER, "elevator", ESTIMATES)
    assert fault.size == pytest.approx(0.08)
    watch.state.fault = replace(fault, source=FORCES, size=0.07)
    assert only(watching.present_faults(watch, 9.0)).size == 0.07  # once, although it is found in two ways
