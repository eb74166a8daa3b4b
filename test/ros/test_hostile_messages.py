"""Whatever a broken node may send: every input of the nodes that only listen, over DDS, with Hypothesis.

The controller and the simulator have the same in ``test_foreign_client``. The processes are shared by all tests.
"""

import random
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Quaternion, Vector3
from harness import JOINTS, ROOT, START_NS, Probe, made_up_streams
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header
from sysid_msgs.msg import AirData, DerivativeEstimate, DerivativeEstimates, FitQuality

from sysid_node.aircraft.load import load_aircraft
from sysid_node.ros.support import conversion

NUMBER = st.floats(allow_nan=True, allow_infinity=True) | st.sampled_from([0.0, 1.0, -1.0, 18.0, 1e300, 1e-300])
TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\x00"), max_size=8)
STAMP = st.builds(
    Time,
    sec=st.integers(-(2**31), 2**31 - 1) | st.sampled_from([0, 2**31 - 1, -(2**31), 1_700_000_000]),
    nanosec=st.integers(0, 2**32 - 1),
)
HEADER = st.builds(Header, stamp=STAMP, frame_id=TEXT)
NAMES = st.lists(st.sampled_from(JOINTS) | TEXT, max_size=6)
ESTIMATE = st.builds(
    DerivativeEstimate,
    name=st.sampled_from(["Cm_de", "Cm_alpha", "Cl_da", "elevator"]) | TEXT,
    value=NUMBER,
    standard_error=NUMBER,
    lower=NUMBER,
    upper=NUMBER,
    valid=st.booleans(),
    status=TEXT,
)
FIT = st.builds(FitQuality, coefficient=st.sampled_from(["Cm", "CL"]) | TEXT, r_squared=NUMBER, residual_std=NUMBER)
PAIR = st.builds(
    KeyValue,
    key=st.sampled_from(["part", "kind"]) | TEXT,
    value=st.sampled_from(["elevator", "loss of effectiveness"]) | TEXT,
)
STATUS = st.builds(DiagnosticStatus, name=TEXT, message=TEXT, values=st.lists(PAIR, max_size=3))


def numbers(*sound: float) -> st.SearchStrategy[list[float]]:
    """Sound numbers, of which up to two are replaced by any."""
    places = st.dictionaries(st.integers(0, len(sound) - 1), NUMBER, max_size=2)
    return places.map(lambda odd: [odd.get(i, x) for i, x in enumerate(sound)])


def imu(header: Header, values: list[float]) -> Imu:
    x = iter(values)
    turn = Quaternion(x=next(x), y=next(x), z=next(x), w=next(x))
    force, rate = (Vector3(x=next(x), y=next(x), z=next(x)) for _ in range(2))
    covariance = [next(x)] + 8 * [0.0]
    return Imu(
        header=header,
        orientation=turn,
        orientation_covariance=covariance,
        linear_acceleration=force,
        angular_velocity=rate,
    )


def air_data(header: Header, values: list[float]) -> AirData:
    names = ("true_airspeed", "angle_of_attack", "sideslip", "air_density")
    return AirData(header=header, **dict(zip(names, values, strict=True)))


LISTS = st.tuples(st.just(list(JOINTS)), numbers(0.01, 0.0, 0.0, 0.5)) | st.tuples(NAMES, st.lists(NUMBER, max_size=6))
JOINT_STATE = st.builds(lambda h, two: JointState(header=h, name=two[0], position=two[1]), HEADER, LISTS)
SOUND_IMU = (0.0, -0.04, 0.0, 1.0, 0.5, 0.0, 9.8, 0.0, 0.0, 0.0, 0.0)
MESSAGES: dict[str, Any] = {
    "imu/data": st.builds(imu, HEADER, numbers(*SOUND_IMU)),
    "air_data": st.builds(air_data, HEADER, numbers(18.0, 0.08, 0.0, 1.2)),
    "actuators": JOINT_STATE,
    "actuators/command": JOINT_STATE,
    "identifier/derivatives": st.builds(
        DerivativeEstimates,
        header=HEADER,
        aircraft=st.just("cdrw") | TEXT,
        method=TEXT,
        derivatives=st.lists(ESTIMATE, max_size=4),
        fits=st.lists(FIT, max_size=2),
        servos=st.lists(ESTIMATE, max_size=2),
    ),
    "fault_monitor/faults": st.builds(DiagnosticArray, header=HEADER, status=st.lists(STATUS, max_size=3)),
}
KINDS = {
    "imu/data": Imu,
    "air_data": AirData,
    "actuators": JointState,
    "actuators/command": JointState,
    "identifier/derivatives": DerivativeEstimates,
    "fault_monitor/faults": DiagnosticArray,
}


class Nodes:
    """The processes, what they wrote, and a node to speak with."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.probe = folder, Probe()
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.publishers = {topic: self.probe.node.create_publisher(KINDS[topic], topic, 1000) for topic in KINDS}
        aircraft = ("--ros-args", "-p", "aircraft:=cdrw")
        self.start("ros.identifier", *aircraft)
        self.start("ros.fault_monitor", *aircraft)
        self.start("ros.exciter", *aircraft, "-p", "watch:=true")
        self.start("ros.recorder", str(folder / "bag"))
        self.start("cli", "view", "--live", "--aircraft", "cdrw", "--save", str(folder / "flight.rrd"))

    def start(self, module: str, *words: str) -> None:
        with (self.folder / module).open("wb") as log:
            command = [sys.executable, "-m", f"sysid_node.{module}", *words]
            self.processes[module] = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)

    def log(self, module: str) -> str:
        return (self.folder / module).read_text(encoding="utf-8")

    def end(self) -> None:
        for process in self.processes.values():
            process.terminate()
        for module, process in self.processes.items():
            assert process.wait(timeout=60.0) == (143 if module == "cli" else 0), self.log(module)
            assert "Traceback" not in self.log(module), self.log(module)

    def check(self) -> None:
        """That all run, and the identifier has not stopped by itself."""
        for module, process in self.processes.items():
            assert process.poll() is None, self.log(module)
            assert "Traceback" not in self.log(module), self.log(module)


@pytest.fixture(scope="module")
def nodes(ros: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nodes]:
    one = Nodes(tmp_path_factory.mktemp("nodes"))
    try:  # all five listen to the IMU
        one.probe.until(lambda: one.publishers["imu/data"].get_subscription_count() >= 5, 60.0)
        yield one
    finally:
        one.end()
        one.probe.close()


def damaged(content: bytes, rng: random.Random) -> bytes:
    """Bytes of a message cut, or some of them changed."""
    data = bytearray(content)
    if rng.random() < 0.3:
        return bytes(data[: rng.randrange(len(data))])
    for _ in range(rng.choice((1, 4, 30))):
        data[rng.randrange(4, len(data))] = rng.choice((0, 255, rng.randrange(256)))
    return bytes(data)


EXAMPLES = settings(max_examples=30, deadline=None, database=None)


@pytest.mark.parametrize("topic", MESSAGES)
def test_whatever_is_sent_on_a_topic_no_node_ends(nodes: Nodes, topic: str) -> None:
    publisher = nodes.publishers[topic]

    @EXAMPLES
    @given(message=MESSAGES[topic], rng=st.randoms(use_true_random=False))
    def send(message: Any, rng: random.Random) -> None:
        publisher.publish(message)
        publisher.publish(damaged(serialize_message(message), rng))
        nodes.probe.spin(0.005)
        nodes.check()

    send()
    nodes.probe.spin(0.3)
    nodes.check()


def sound(message: DerivativeEstimates, after: int) -> bool:
    """Whether estimates are of a time after a stamp (ns), and not stale."""
    stale = {one.status for one in message.derivatives} == {"stale input"}
    return conversion.stamp_ns(message.header.stamp) > after and not stale


@pytest.mark.slow
def test_whatever_is_sent_on_all_topics_a_sound_flight_is_identified_afterwards(nodes: Nodes) -> None:
    @EXAMPLES
    @given(
        messages=st.lists(
            st.sampled_from(list(MESSAGES)).flatmap(lambda t: st.tuples(st.just(t), MESSAGES[t])), max_size=20
        )
    )
    def send(messages: list[tuple[str, Any]]) -> None:
        for topic, message in messages:
            nodes.publishers[topic].publish(message)
        nodes.probe.spin(0.005)

    send()
    nodes.check()
    probe = nodes.probe
    probe.estimates.clear()
    flight, last, found, begin = made_up_streams(60.0), START_NS + 3_900_000_000, [], 0.0
    while not found and begin < 60.0:  # what a busy machine loses is followed by more
        probe.speak(flight, start=begin, stop=begin + 0.5)
        probe.spin(0.1)
        found, begin = [one for one in probe.estimates if sound(one, last)], begin + 0.5
    assert found, {name: status.message for name, status in probe.diagnostics.items()}
    # how many came on the way is a matter of queues: the flight is sent as fast as it can be
    assert len(found[0].derivatives) == len(load_aircraft("cdrw").derivatives)
    nodes.check()
