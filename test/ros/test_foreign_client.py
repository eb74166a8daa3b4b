"""The nodes as another team's node meets them: by rclpy and messages alone, nothing of this package is imported.

A controller in the namespace /uav1 is flown by this module, with constant measurements, and fed with whatever a broken
node may send. A simulator flies in the namespace /uav2; exciter and fault monitor in /uav3 hear what the controller
hears. All are processes of their own, which the tests share.
"""

import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Quaternion, Vector3
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from sysid_msgs.msg import AirData, DerivativeEstimate, DerivativeEstimates, EstimateCorrelation, FitQuality

ROOT = Path(__file__).resolve().parents[2]
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
ANY = st.floats(allow_nan=True, allow_infinity=True)
CONTROLLER = "uav1/adaptive_controller: state"
SURFACES = ("elevator", "aileron", "rudder")
LIMITS = {"elevator": 0.35, "aileron": 0.35, "rudder": 0.35}  # rad, of the cdrw
ALPHA, SPEED = 0.086, 18.0  # rad, m/s: about level flight


class Client:
    """A node that flies /uav1 at 50 Hz, and hears what both vehicles say."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("another_team")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.flies, self.stamp = True, 0  # ns, instead of the clock's
        self.commands: list[tuple[int, dict[str, float]]] = []  # stamps in ns
        self.tracking: dict[str, float] = {}
        self.simulated: list[Imu] = []
        self.status: dict[str, DiagnosticStatus] = {}
        make = self.node.create_publisher
        self.imu = [make(Imu, f"/{uav}/imu/data", BEST_EFFORT) for uav in ("uav1", "uav3")]
        self.air = [make(AirData, f"/{uav}/air_data", BEST_EFFORT) for uav in ("uav1", "uav3")]
        self.others = [make(JointState, f"/uav3/actuators{part}", 10) for part in ("", "/command")]
        self.faults = make(DiagnosticArray, "/uav3/fault_monitor/faults", 10)
        self.excitation = make(JointState, "/uav1/actuators/excitation", 10)
        self.points = make(JointState, "/uav1/set_points", BEST_EFFORT)
        self.estimates = make(DerivativeEstimates, "/uav1/identifier/derivatives", 10)
        self.correlation = make(EstimateCorrelation, "/uav1/identifier/correlation", KEPT)
        self.others_estimates = make(DerivativeEstimates, "/uav3/identifier/derivatives", 10)
        self.excitation_of_others: list[tuple[int, list[float]]] = []  # stamps in ns, rad
        self.command = make(JointState, "/uav2/actuators/command", 10)
        hear = self.node.create_subscription
        hear(JointState, "/uav1/actuators/command", self._on_command, 100)
        hear(JointState, "/uav1/adaptive_controller/tracking", self._on_tracking, 100)
        hear(JointState, "/uav3/actuators/excitation", self._on_excitation, 100)
        hear(Imu, "/uav2/imu/data", self.simulated.append, BEST_EFFORT)
        hear(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        self.node.create_timer(0.02, self._fly)

    def _on_command(self, message: JointState) -> None:
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        self.commands.append((stamp, dict(zip(message.name, message.position, strict=True))))

    def _on_excitation(self, message: JointState) -> None:
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        self.excitation_of_others.append((stamp, list(message.position)))

    def _on_tracking(self, message: JointState) -> None:
        self.tracking = dict(zip(message.name, message.position, strict=True))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.status |= {status.name: status for status in message.status}

    def _fly(self) -> None:
        if self.flies:
            self.say_air()
            self.say_imu()

    def header(self) -> Header:
        stamp = self.stamp or self.node.get_clock().now().nanoseconds
        return Header(stamp=Time(sec=stamp // 10**9, nanosec=stamp % 10**9))

    def say_imu(self, rates: tuple[float, ...] = (0.0, 0.0, 0.0), tilt: float = -ALPHA) -> None:
        """``rates`` in forward-left-up axes; nose up is a turn by less than nothing about the left wing."""
        p, q, r = rates
        attitude = Quaternion(y=math.sin(0.5 * tilt), w=math.cos(0.5 * tilt))
        force = Vector3(x=0.0, y=0.0, z=9.81)
        rate = Vector3(x=p, y=q, z=r)
        message = Imu(header=self.header(), orientation=attitude, linear_acceleration=force, angular_velocity=rate)
        for publisher in self.imu:
            publisher.publish(message)

    def say_air(self, values: tuple[float, ...] = (SPEED, ALPHA, 0.0, 1.225)) -> None:
        names = ("true_airspeed", "angle_of_attack", "sideslip", "air_density")
        message = AirData(header=self.header(), **dict(zip(names, values, strict=True)))
        for publisher in self.air:
            publisher.publish(message)

    def joints(self, values: dict[str, float]) -> JointState:
        return JointState(header=self.header(), name=list(values), position=list(values.values()))

    def spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=left)

    def until(self, condition: Callable[[], Any], patience: float = 60.0) -> Any:
        """Spin until the condition holds; its value."""
        end = time.monotonic() + patience
        while not (found := condition()):
            assert time.monotonic() < end, {name: one.message for name, one in self.status.items()}
            self.executor.spin_once(timeout_sec=0.05)
        return found

    def said(self, name: str) -> str:
        return str(self.status[name].message) if name in self.status else ""

    def call(self, kind: Any, name: str, request: Any) -> Any:
        client = self.node.create_client(kind, name)
        self.until(client.service_is_ready)
        self.spin(0.3)
        future = client.call_async(request)
        self.until(future.done)
        return future.result()


class Vehicles:
    """The processes, and what they wrote."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, *words: str) -> None:
        command = [sys.executable, "-m", f"sysid_node.ros.{name}", "--ros-args", "-p", "aircraft:=cdrw", *words]
        with (self.folder / name).open("wb") as log:
            self.processes[name] = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)

    def log(self, name: str) -> str:
        return (self.folder / name).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def vehicles(ros: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Vehicles]:
    one = Vehicles(tmp_path_factory.mktemp("logs"))
    expiry = ("-p", "set_points_expire_after:=0.5", "-p", "gain_rate:=20.0")
    one.start("adaptive_controller", "-r", "__ns:=/uav1", *expiry)
    one.start("exciter", "-r", "__ns:=/uav3", "-p", "watch:=true")
    one.start("fault_monitor", "-r", "__ns:=/uav3")
    one.start("flight_simulator", "-r", "__ns:=/uav2", "-p", "rate:=20.0")
    yield one
    for process in one.processes.values():
        process.terminate()
    for name, process in one.processes.items():
        assert process.wait(timeout=60.0) == 0, one.log(name)
        assert "Traceback" not in one.log(name), one.log(name)


@pytest.fixture(scope="module")
def client(vehicles: Vehicles) -> Iterator[Client]:
    one = Client()
    one.until(lambda: len(one.commands) > 50 and one.simulated, 90.0)
    yield one
    one.executor.shutdown()
    one.node.destroy_node()


def fault(part: str, kind: str) -> DiagnosticArray:
    """A fault as the fault monitor reports it."""
    pairs = [KeyValue(key="part", value=part), KeyValue(key="kind", value=kind)]
    return DiagnosticArray(status=[DiagnosticStatus(name=f"fault_monitor: {part}", values=pairs)])


def known_derivatives() -> DerivativeEstimates:
    """All that the exciter is asked for, with narrow intervals."""
    names = ("Cm_de", "Cm_alpha", "Cm_q", "Cl_da", "Cl_p", "Cn_dr", "Cn_r", "Cn_beta", "CL_alpha")
    rows = [
        DerivativeEstimate(name=name, value=1.0, lower=0.999, upper=1.001, standard_error=5e-4, valid=True, status="ok")
        for name in names
    ]
    return DerivativeEstimates(aircraft="cdrw", derivatives=rows)


def last(client: Client) -> dict[str, float]:
    """The next command."""
    client.commands.clear()
    client.until(lambda: client.commands)
    return client.commands[-1][1]


@pytest.mark.slow
def test_excitation_is_bounded_and_leaves_nothing_behind(client: Client) -> None:
    """1e308 rad for 0.3 s used to keep the elevator away for 35 s. Half a second later it is where it was."""
    before = last(client)["elevator"]
    for _ in range(15):
        client.excitation.publish(client.joints({"elevator": 1e308, "aileron": -1e308}))
        client.spin(0.02)
    moved = last(client)
    assert 0.05 < moved["elevator"] - before <= 0.11
    client.spin(0.6)
    assert last(client)["elevator"] == pytest.approx(before, abs=0.005)
    client.until(lambda: "excitation clipped" in client.said(CONTROLLER))
    client.excitation.publish(client.joints({"elevator": math.nan}))
    client.until(lambda: "excitation not finite, dropped" in client.said(CONTROLLER))


@pytest.mark.slow
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=st.tuples(*[ANY] * 9),
    seconds=st.integers(-(2**31), 2**31 - 1) | st.just(2**31 - 1),
    nanoseconds=st.integers(0, 2**32 - 1),
    text=st.text("aeilorv/_ .", max_size=8),
    cut=st.integers(1, 30),
)
def test_whatever_is_sent_commands_stay_within_the_limits(
    client: Client, vehicles: Vehicles, values: tuple[float, ...], seconds: int, nanoseconds: int, text: str, cut: int
) -> None:
    """Every input of the controller, and that of the simulator; some messages are cut off."""
    stamped = Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=text)
    client.say_imu(values[:3])
    client.say_air(values[3:7])
    at_odd_times = (client.imu, Imu(header=stamped)), (client.air, AirData(header=stamped, true_airspeed=SPEED))
    for publishers, message in at_odd_times:
        for publisher in publishers:
            publisher.publish(message)
    anything = JointState(header=stamped, name=["elevator", text, "roll", "pitch_rate"], position=list(values[:4]))
    wrong_length = JointState(header=stamped, name=["elevator"], position=list(values))
    for message in (anything, wrong_length):
        for publisher in (client.excitation, client.points, client.command, *client.others):
            publisher.publish(message)
            publisher.publish(serialize_message(message)[:-cut])
    client.faults.publish(fault(text, text))
    estimate = DerivativeEstimate(name="Cm_de", value=values[7], lower=values[8], upper=values[0], valid=True)
    names = ["Cm_de", text, "Cm_q"]
    client.correlation.publish(EstimateCorrelation(aircraft="cdrw", names=names, correlation=list(values)))
    client.correlation.publish(EstimateCorrelation(aircraft="cdrw", names=names[:cut], correlation=list(values[:cut])))
    client.estimates.publish(DerivativeEstimates(header=stamped, aircraft="cdrw", derivatives=[estimate]))
    client.estimates.publish(DerivativeEstimates(header=stamped, aircraft=text, derivatives=[estimate]))
    client.commands.clear()
    client.until(lambda: len(client.commands) > 2)
    for _, command in client.commands:
        assert all(abs(command[name]) <= LIMITS[name] + 1e-9 for name in SURFACES), command
        assert 0.0 <= command["throttle"] <= 1.0
    assert all(process.poll() is None for process in vehicles.processes.values())


@pytest.mark.slow
def test_set_points_of_a_best_effort_publisher_are_flown_until_they_expire(client: Client) -> None:
    client.until(lambda: abs(client.tracking.get("roll", 1.0)) < 0.01)

    def rolled() -> bool:
        client.points.publish(client.joints({"roll": 0.3}))
        return client.tracking["roll"] > 0.28

    client.until(rolled)
    client.until(lambda: "set-points: none for 0.5 s: level flight is flown" in client.said(CONTROLLER))
    client.until(lambda: abs(client.tracking["roll"]) < 0.01)


@pytest.mark.slow
def test_one_pitch_rate_does_not_move_the_reference_for_ever(client: Client) -> None:
    client.points.publish(client.joints({"pitch_rate": 0.3}))
    client.spin(0.3)
    begun = client.tracking["pitch"]
    client.spin(1.5)
    assert client.tracking["pitch"] < begun + 0.15
    for _ in range(50):
        client.points.publish(client.joints({"pitch_rate": 2.0}))
        client.spin(0.02)
    assert client.tracking["pitch"] <= 0.4 + 1e-6


@pytest.mark.slow
def test_a_misspelt_set_point_is_said(client: Client, vehicles: Vehicles) -> None:
    words = "/uav1/set_points: set-point 'rol' is not known: left out; did you mean 'roll'?"

    def said() -> bool:
        client.points.publish(client.joints({"rol": 0.2}))
        return words in client.said(CONTROLLER) and words in vehicles.log("adaptive_controller")

    client.until(said)


@pytest.mark.slow
def test_a_set_point_in_degrees_is_said(client: Client, vehicles: Vehicles) -> None:
    """The limit is flown; nothing had said so."""
    words = "/uav1/set_points: set-point 'roll' of 20 rad is beyond -0.8 to 0.8 rad: the limit is flown"

    def said() -> bool:
        client.points.publish(client.joints({"roll": 20.0}))
        return words in client.said(CONTROLLER) and words in vehicles.log("adaptive_controller")

    client.until(said)


@pytest.mark.slow
def test_air_data_by_another_clock_are_said(client: Client, vehicles: Vehicles) -> None:
    """They count as not measured, as they must; only that had been said, and not why."""
    words = "/uav1/air_data: stamped 3.6e+03 s before /uav1/imu/data: counts as not measured"
    client.flies = False

    def said() -> bool:
        client.say_imu()
        client.stamp = client.node.get_clock().now().nanoseconds - 3600 * 10**9
        client.say_air()
        client.stamp = 0
        client.spin(0.02)
        return words in client.said(CONTROLLER) and words in vehicles.log("adaptive_controller")

    client.until(said)
    client.flies = True
    client.until(lambda: "counts as not measured" not in client.said(CONTROLLER))


def test_stamps_that_stand_still_count_as_silence(client: Client, vehicles: Vehicles) -> None:
    """The controller had sent no more commands, and said nothing in its log; an excitation would never have ended."""
    words = "its stamps do not advance, messages are left out"
    client.stamp = client.node.get_clock().now().nanoseconds
    client.until(lambda: f"/uav1/imu/data: {words}: surfaces at level flight's" in client.said(CONTROLLER))
    client.until(lambda: f"/uav1/imu/data: {words}" in vehicles.log("adaptive_controller"))
    client.until(lambda: f"/uav3/imu/data: {words}" in client.said("uav3/exciter: state"))
    client.commands.clear()
    client.until(lambda: len(client.commands) > 20)
    client.stamp = 0
    client.until(lambda: words not in client.said(CONTROLLER))


@pytest.mark.slow
def test_silence_is_said_under_the_resolved_name(client: Client, vehicles: Vehicles) -> None:
    client.flies = False
    client.until(lambda: "/uav1/imu/data silent" in client.said(CONTROLLER))
    client.until(lambda: "/uav1/imu/data: no message for" in vehicles.log("adaptive_controller"))
    for node in ("exciter", "fault_monitor"):
        client.until(lambda node=node: "/uav3/imu/data: no message for" in vehicles.log(node))  # type: ignore[misc]
    client.until(lambda: "/uav2/actuators/command: no message" in vehicles.log("flight_simulator"))
    client.flies = True
    client.until(lambda: "/uav1/imu/data" not in client.said(CONTROLLER))
    assert "clock set" not in client.said(CONTROLLER)


def test_a_reported_fault_of_a_surface_keeps_the_exciter_going(client: Client) -> None:
    name = "uav3/exciter: state"
    assert client.call(Trigger, "/uav3/exciter/start", Trigger.Request()).success
    client.until(lambda: client.said(name).startswith("exciting"))

    def said() -> bool:
        client.faults.publish(fault("elevator", "loss of effectiveness"))
        events = {pair.key: pair.value for pair in client.status[name].values}
        return events["last event"] == "goes on: elevator: loss of effectiveness"

    client.faults.publish(fault("imu/data", "sensor silent"))
    client.until(said)
    assert client.call(Trigger, "/uav3/exciter/stop", Trigger.Request()).success


def test_a_reported_fault_has_a_watching_exciter_begin_again_at_once(client: Client) -> None:
    """Without reports of faults it began 16 s after a lost elevator was named, as estimates stayed valid so long."""
    name, known = "uav3/exciter: state", known_derivatives()
    client.faults.publish(DiagnosticArray())
    assert client.call(Trigger, "/uav3/exciter/start", Trigger.Request()).success

    def done() -> bool:
        client.others_estimates.publish(known)
        return client.said(name).startswith("known after")

    client.until(done)

    def rests() -> bool:
        newest = client.excitation_of_others[-6:]
        return len(newest) == 6 and not any(any(moved) for _, moved in newest)

    client.until(rests)
    client.excitation_of_others.clear()
    reported = client.node.get_clock().now().nanoseconds
    client.faults.publish(fault("elevator", "loss of effectiveness"))
    client.until(lambda: any(any(moved) for _, moved in client.excitation_of_others))
    begun = next(stamp for stamp, moved in client.excitation_of_others if any(moved))
    assert begun - reported < 8_000_000_000, "a busy machine is slow, too"
    client.until(lambda: "begun again: elevator: loss of effectiveness" in str(client.status[name].values))
    assert client.call(Trigger, "/uav3/exciter/stop", Trigger.Request()).success


def test_another_aircrafts_estimates_are_left_out(client: Client) -> None:
    def said() -> bool:
        foreign = DerivativeEstimates(header=client.header(), aircraft="kestrel")
        client.estimates.publish(foreign)
        client.others_estimates.publish(foreign)
        hearers = (CONTROLLER, "uav3/exciter: state", "uav3/fault_monitor: state")
        return all("of aircraft 'kestrel', left out" in client.said(name) for name in hearers)

    client.until(said)


def test_what_is_no_correlation_is_said(client: Client) -> None:
    def said() -> bool:
        client.correlation.publish(EstimateCorrelation(aircraft="cdrw", names=["Cm_de", "Cm_q"], correlation=[1.0]))
        return "correlation implausible, dropped" in client.said(CONTROLLER)

    client.until(said)


def answers(client: Client, count: int, pitch_rate: float = 0.0) -> list[float]:
    """The elevator's commands for so many IMU messages 20 ms apart, whose pitch rate (rad/s) changes sign each time.

    A command answers the message whose stamp it carries, however late the machine delivers it. A message that was lost
    is sent again one step later.
    """
    client.flies, found = False, []
    client.stamp = client.node.get_clock().now().nanoseconds
    while len(found) < count:
        client.stamp += 20_000_000
        client.spin(max(0.0, 1e-9 * (client.stamp - client.node.get_clock().now().nanoseconds)))
        client.commands.clear()
        client.say_air()
        client.say_imu((0.0, -pitch_rate if len(found) % 2 else pitch_rate, 0.0))
        end = time.monotonic() + 0.5
        while not any(stamp == client.stamp for stamp, _ in client.commands) and time.monotonic() < end:
            client.executor.spin_once(timeout_sec=0.05)
        found += [command["elevator"] for stamp, command in client.commands if stamp == client.stamp]
    client.flies, client.stamp = True, 0
    return found


def jump(client: Client) -> float:
    """How far the elevator moves when the pitch rate jumps by 0.02 rad/s: the gain that is flown, seen from outside."""
    return statistics.median(abs(b - a) for a, b in pairwise(answers(client, 8, 0.01)[2:]))


def weak_elevator(client: Client) -> DerivativeEstimates:
    """What an identifier says of a cdrw whose elevator has 60 % of its effect."""
    rows = [("Cm_de", -0.6 * 0.4606), ("Cm_alpha", -0.2347)]
    derivatives = [
        DerivativeEstimate(name=n, value=v, lower=v - 0.01, upper=v + 0.01, valid=True, status="ok") for n, v in rows
    ]
    fits = [FitQuality(coefficient="Cm", r_squared=0.99)]
    return DerivativeEstimates(header=client.header(), aircraft="cdrw", derivatives=derivatives, fits=fits)


def test_when_estimates_cease_the_surfaces_move_by_the_baseline_within_half_a_second(client: Client) -> None:
    baseline = jump(client)

    def adapted() -> bool:
        client.estimates.publish(weak_elevator(client))
        client.spin(0.04)
        return "pitch: adapted" in client.said(CONTROLLER)

    client.until(adapted)
    for _ in range(10):
        client.estimates.publish(weak_elevator(client))
        client.spin(0.04)
    assert jump(client) > 1.2 * baseline
    client.estimates.publish(weak_elevator(client))
    answers(client, 25)  # half a second by the stamps
    assert jump(client) == pytest.approx(baseline, rel=0.05)


def test_changes_of_what_is_flown_and_limits_reached_are_in_the_log(client: Client, vehicles: Vehicles) -> None:
    """After gains were adapted and the baseline came back: a nose that is far too high, whatever the elevator does."""
    for words in ("pitch gains: adapted", "pitch gains: baseline: no estimates for"):
        client.until(lambda words=words: words in vehicles.log("adaptive_controller"))  # type: ignore[misc]
    client.flies = False

    def said() -> bool:
        client.say_air()
        client.say_imu(tilt=-1.2)
        client.spin(0.02)
        log = vehicles.log("adaptive_controller")
        return "elevator: at its limit of 0.35 rad" in log and "pitch gains: baseline: the tracking error was" in log

    client.until(said)
    client.until(lambda: "tracking: " in client.said(CONTROLLER))
    client.flies = True


@pytest.mark.slow
def test_a_simulator_that_diverges_says_so_is_silent_and_can_be_reset(client: Client, vehicles: Vehicles) -> None:
    value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value="cg_shift:x=-2")
    request = SetParameters.Request(parameters=[Parameter(name="effects", value=value)])
    set_effects = "/uav2/flight_simulator/set_parameters"
    assert client.call(SetParameters, set_effects, request).results[0].successful
    name = "uav2/flight_simulator: state"
    client.until(lambda: client.status[name].level == DiagnosticStatus.ERROR, 60.0)
    assert "diverged" in client.said(name)
    assert "/uav2/flight_simulator/reset" in vehicles.log("flight_simulator")
    rates = [abs(x) for one in client.simulated for x in (one.angular_velocity.x, one.linear_acceleration.z)]
    assert all(map(math.isfinite, rates)), "not one message that is not finite"
    before = client.simulated[-1].header.stamp
    client.simulated.clear()
    client.spin(0.5)
    assert not client.simulated
    request.parameters[0].value.string_value = ""
    assert client.call(SetParameters, set_effects, request).results[0].successful
    assert client.call(Trigger, "/uav2/flight_simulator/reset", Trigger.Request()).success
    client.until(lambda: len(client.simulated) > 5)
    after = client.simulated[0].header.stamp
    assert (after.sec, after.nanosec) > (before.sec, before.nanosec)
    client.until(lambda: client.status[name].level != DiagnosticStatus.ERROR)
