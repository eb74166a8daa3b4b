"""The live node, in a process of its own, over DDS."""

import contextlib
import json
import math
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from due_times import due_times
from harness import ROOT, START_NS, Probe, ended, identifier, made_up_streams, start_identifier
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from sysid_msgs.msg import AirData, EstimateCorrelation

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.streams import Arrival, Streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates
from sysid_node.ros.support import conversion
from sysid_node.ros.support.conversion import estimates_from_message, stamp_ns

SECONDS = 15.0  # of the bag that is played: long enough for valid estimates


def expected_of(streams: Streams) -> dict[int, Estimates]:
    """What the desk makes of a flight at the default publish rate: header stamp -> estimates."""
    aircraft, settings = load_aircraft("cdrw"), OnlineSettings()
    aligned = align_streams(aircraft, streams, settings.max_gap)
    due = due_times(aligned.time, aligned.wait, 20.0)
    results = run(aircraft, settings, aligned.time, aligned.samples, due)
    stamps = aligned.stamps[np.searchsorted(aligned.time, due)]
    return dict(zip(stamps.tolist(), results, strict=True))


def beginning(streams: Streams, seconds: float) -> Streams:
    """The first seconds of a flight."""
    end = int(streams.imu.arrival.stamp_ns[0]) + round(seconds * 1e9)
    imu, air, joints = (stream.arrival for stream in (streams.imu, streams.air_data, streams.actuators))
    kept = [one.stamp_ns < end for one in (imu, air, joints)]
    arrivals = [
        Arrival(one.stamp_ns[k], one.log_ns[k], one.order[k]) for one, k in zip((imu, air, joints), kept, strict=True)
    ]
    return replace(
        streams,
        imu=replace(
            streams.imu, arrival=arrivals[0], values=streams.imu.values[kept[0]], attitude=streams.imu.attitude[kept[0]]
        ),
        air_data=replace(streams.air_data, arrival=arrivals[1], values=streams.air_data.values[kept[1]]),
        actuators=replace(streams.actuators, arrival=arrivals[2], positions=streams.actuators.positions[kept[2]]),
    )


def words(probe: Probe, part: str, level: int) -> str:
    """What a part of /diagnostics says, once it does at that level."""
    status = probe.diagnostics.get(f"identifier: {part}")
    return status.message if status and status.level == bytes([level]) else ""


def set_parameter(probe: Probe, name: str, value: ParameterValue) -> SetParametersResult:
    request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
    return probe.ask(SetParameters, "/identifier/set_parameters", request).results[0]


def bits(estimates: Estimates) -> list[object]:
    """All numbers of an estimate so that equality is to the last bit, NaN included."""
    rows: list[tuple[object, ...]] = [*estimates.derivatives.values(), *estimates.fits.values()]
    rows += estimates.servos.values()
    return [[x.hex() if isinstance(x, float) else x for x in row] for row in rows]


@pytest.mark.slow
def test_a_bag_through_dds_gives_what_the_desk_gives_to_the_last_bit(probe: Probe, tmp_path: Path) -> None:
    bag = tmp_path / "multistep"
    write_streams(bag, beginning(read_streams(ROOT / "bags" / "cdrw_multistep"), SECONDS))
    expected = expected_of(read_streams(bag))
    assert len(expected) == pytest.approx(20 * SECONDS, abs=2)
    with identifier():
        probe.await_identifier()
        probe.play(bag)
        last = max(expected)  # a busy machine may still be computing when the player has finished
        # the gap of a stamp is a message of its own, which follows the estimates
        topics = (probe.estimates, probe.gaps)
        probe.until(lambda: all(any(stamp_ns(m.header.stamp) == last for m in t[-100:]) for t in topics), 60.0)
    # the first at each stamp: the last is said again once it is stale
    heard = {stamp_ns(message.header.stamp): message for message in reversed(probe.estimates)}
    assert heard.keys() >= expected.keys()
    for stamp, estimates in expected.items():
        assert bits(estimates_from_message(heard[stamp], START_NS)) == bits(estimates), f"at {estimates.time} s"
    assert any(d.valid for d in heard[max(expected)].derivatives), "the comparison must have something to compare"
    assert {d.name for d in heard[max(expected)].servos} == {"elevator", "aileron", "rudder"}
    assert any(d.systematic_error > 0.0 for d in heard[max(expected)].derivatives)
    assert {heard[stamp].header.frame_id for stamp in expected} == {"imu"}
    gap = next(one for one in probe.gaps if stamp_ns(one.header.stamp) == max(expected))
    assert (gap.aircraft, gap.header.frame_id) == ("cdrw", "imu")
    assert set(gap.coefficients) == {"CL", "CD", "CY", "Cl", "Cm", "Cn"}
    assert all(value > 0.0 for value in (*gap.gap_std, *gap.noise_std, *gap.relative))
    known = {d.name: d for d in heard[max(expected)].servos if d.valid}
    assert known and gap.servos == list(known)
    assert list(gap.servo_time) == [d.value for d in known.values()]
    assert list(gap.servo_time_error) == [d.standard_error for d in known.values()]
    assert all(map(math.isnan, gap.servo_time_in_file)), "the file says nothing of them"


@pytest.mark.slow
def test_bad_messages_are_counted_and_survived(probe: Probe) -> None:
    """NaN, degrees, broken messages, stamps repeated, reversed and absent, a clock that leaps: each is named, and the
    flight goes on.
    """
    flight = made_up_streams(4.0)
    with identifier() as process:
        probe.await_identifier()
        probe.speak(flight, stop=1.0)
        now = START_NS + 10**9
        for values in ((np.nan,) * 6, (1e9, 0, 0, 0, 0, 0), (0, 0, 9.8, 200.0, 0, 0)):
            probe.say_imu(now + 1, values)
        probe.imu.publish(b"\x00\x01\x00\x00 cut short")
        good = (0.0, 0.0, 9.8, 0.0, 0.0, 0.0)
        for stamp in (now, now, now - 500_000_000, 0, now - 100 * 10**9):
            probe.say_imu(stamp, good)
        probe.say_air_data(now + 1, (np.nan, 0.0, 0.0, 1.2))
        probe.say_air_data(now + 1, (18.0, 5.7, 0.0, 1.2))
        probe.say_actuators(now + 1, ("flaps",), (0.1,))
        probe.say_actuators(now + 1, (), ())
        probe.speak(flight, start=1.0)
        probe.until(lambda: probe.said("input", "rejected, actuators: joint 'elevator' missing or not finite"))
        for reason in (
            "imu/data: not a message of this type",
            "imu/data: not finite",
            "imu/data: specific force over 300 m/s^2",
            "imu/data: angular rate over 35 rad/s (deg/s?)",
            "imu/data: duplicate stamp",
            "imu/data: out of order",
            "imu/data: no stamp",
            "imu/data: clock step",
            "air_data: true_airspeed not measured",
            "air_data: angle_of_attack over pi/2 rad (degrees?)",
        ):
            assert int(probe.said("input", f"rejected, {reason}")) >= 1, reason
        probe.until(lambda: float(probe.said("estimate", "flight time (s)")) > 3.5)
        assert probe.said("state", "exceptions in callbacks") == "0"
        assert process.poll() is None


@pytest.mark.slow
def test_an_imu_that_is_interrupted_every_second_is_said(probe: Probe) -> None:
    """On /diagnostics and in the log: else all derivatives would converge for ever, without a reason."""
    flight = made_up_streams(60.0)
    said: list[str] = []
    with ended(start_identifier(), said):
        probe.await_identifier()
        told, second = "", 0
        while second < 60 and "interruptions" not in told:  # while messages come, as silence is told first
            probe.speak(flight, start=second + 0.3, stop=second + 1.0)
            told, second = words(probe, "input", level=1), second + 1
    assert "no longer part without one than 0.7 s: estimates need 4 s or more" in told
    assert "samples: " in said[0]
    assert "interruptions of up to 0.3" in said[0]


def test_a_second_publisher_of_an_input_is_said(probe: Probe) -> None:
    second = probe.node.create_publisher(Imu, "imu/data", 10)
    said: list[str] = []
    words = "/imu/data: 2 publishers, taken as one"
    with ended(start_identifier(), said):
        probe.until(lambda: words in getattr(probe.diagnostics.get("identifier: input"), "message", ""))
    assert words in said[0]
    probe.node.destroy_publisher(second)


@pytest.mark.slow
def test_a_second_identifier_of_the_same_name_is_said(probe: Probe) -> None:
    said: list[str] = []
    words = "/identifier/derivatives: 2 nodes publish it, and estimates of all come mixed"
    with ended(start_identifier(), said), ended(start_identifier()):
        probe.until(lambda: words in getattr(probe.diagnostics.get("identifier: input"), "message", ""))
        probe.until(lambda: probe.node.count_publishers("/identifier/derivatives") == 2)
        probe.spin(1.5)
    assert words in said[0]


@pytest.mark.slow
def test_wrong_joints_are_said_with_what_was_expected_and_what_came(probe: Probe) -> None:
    """In a namespace: its names carry it, on /diagnostics and in the log."""
    process = start_identifier(namespace="/uav1")
    name = "uav1/identifier: input"
    imu, air, joints = (
        probe.node.create_publisher(kind, f"/uav1/{topic}", 100)
        for kind, topic in ((Imu, "imu/data"), (AirData, "air_data"), (JointState, "actuators"))
    )
    probe.until(lambda: name in probe.diagnostics and joints.get_subscription_count())
    assert "/uav1/imu/data never received" in probe.diagnostics[name].message
    assert "no estimate yet" in probe.diagnostics["uav1/identifier: estimate"].message

    def said() -> bool:
        header = conversion.header(probe.node.get_clock().now().nanoseconds, "")
        joints.publish(JointState(header=header, name=["flaps", "throttle"], position=[0.1, 0.5]))
        air.publish(AirData(header=header, true_airspeed=float("nan")))
        imu.publish(Imu(header=header))
        message = probe.diagnostics[name].message
        return "/uav1/actuators: all of" in message and "/uav1/air_data: all of" in message

    probe.until(said)
    assert probe.diagnostics[name].level == b"\x02"
    probe.spin(1.0)
    process.send_signal(signal.SIGINT)
    text, _ = process.communicate(timeout=60.0)
    assert "expected joints elevator, aileron, rudder, throttle, got flaps, throttle" in text
    assert "/uav1/air_data: all of" in text
    assert "true_airspeed not measured" in text
    for publisher in (imu, air, joints):
        probe.node.destroy_publisher(publisher)


@pytest.mark.slow
def test_what_actuators_are_taken_for_is_said_once_and_again_when_it_changes(probe: Probe) -> None:
    """Smooth joints are positions until they jump; the log and /diagnostics say both."""
    flight = made_up_streams(6.0)
    late = flight.actuators.arrival.stamp_ns > START_NS + 3 * 10**9
    steps = 0.1 * ((np.arange(late.size) // 20) % 2)
    flight.actuators.positions[late, :3] = steps[late, np.newaxis]
    said: list[str] = []
    with ended(start_identifier(), said):
        probe.await_identifier()
        probe.speak(flight, stop=2.9)
        probe.until(lambda: probe.said("estimate", "actuators carry") == "positions")
        probe.speak(flight, start=2.9)
        probe.until(lambda: probe.said("estimate", "actuators carry") == "commands")
    assert said[0].count("Actuators are taken as positions: no command jumps that a surface could not follow.") == 1
    assert said[0].count("Actuators carry commands (inferred from the messages); the aircraft file states nothing") == 1


@pytest.mark.slow
def test_forward_right_down_messages_give_the_same_in_simulated_time(probe: Probe, tmp_path: Path) -> None:
    """With use_sim_time and /clock the lag is counted in the flight's time."""
    turned = tmp_path / "frd"
    write_streams(turned, made_up_streams(4.0), frame="frd")
    expected = expected_of(made_up_streams(4.0))
    with identifier("body_frame:=frd", "use_sim_time:=true"):
        probe.await_identifier()
        probe.play(turned, "--clock")
        last = max(expected)
        live = probe.until(lambda: [m for m in probe.estimates[-100:] if stamp_ns(m.header.stamp) == last], 60.0)
        probe.until(lambda: probe.said("computation", "lag (s)"), 60.0)
        # by a clock on the wall it would be years; a busy machine may be seconds late at four times the flight's pace
        assert abs(float(probe.said("computation", "lag (s)"))) < 20.0
    assert bits(estimates_from_message(live[0], START_NS)) == bits(expected[last])


def correlation_heard_late(probe: Probe) -> EstimateCorrelation:
    """The last message of how errors go together, which is kept for those who subscribe late."""
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    heard: list[EstimateCorrelation] = []
    late = probe.node.create_subscription(EstimateCorrelation, "/identifier/correlation", heard.append, kept)
    probe.until(lambda: heard)
    probe.node.destroy_subscription(late)
    return heard[0]


@pytest.mark.slow
def test_a_missing_topic_late_subscribers_silence_and_sigterm(probe: Probe) -> None:
    """One node's life: it names the topic that is missing, estimates, keeps what it said, and says what is stale."""
    flight = made_up_streams(5.0)
    process = start_identifier()
    with contextlib.ExitStack() as stack:
        stack.callback(process.kill)
        probe.await_identifier()
        probe.speak(flight, stop=1.0, air_data=False)
        assert "air_data never received" in probe.until(lambda: words(probe, "input", level=3))
        assert not probe.estimates
        probe.speak(flight, start=1.0)
        probe.until(lambda: probe.estimates and {d.status for d in probe.estimates[-1].derivatives} == {"stale input"})
        assert any(math.isfinite(one.derivatives[0].value) for one in probe.estimates)
        assert not any(d.valid for d in probe.estimates[-1].derivatives)
        assert "imu/data silent for" in probe.until(lambda: words(probe, "input", level=3))
        message = correlation_heard_late(probe)
        process.send_signal(signal.SIGTERM)
        text, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0, text
    assert "Traceback" not in text
    assert message.aircraft == "cdrw"
    assert set(message.names) <= load_aircraft("cdrw").derivatives.keys()
    matrix = np.array(message.correlation).reshape(len(message.names), -1)
    np.testing.assert_allclose(matrix.diagonal(), 1.0)
    np.testing.assert_allclose(matrix, matrix.T)
    assert np.abs(matrix).max() <= 1.0


def test_what_no_aircraft_has_and_effects_that_are_not_taken_into_account_are_said(
    probe: Probe, tmp_path: Path
) -> None:
    file, said = tmp_path / "heavy.yaml", list[str]()
    effects = {"stall_separation": {"depth": UncertainValue(1.0)}}
    file.write_text(dump_aircraft(replace(load_aircraft("cdrw"), mass=4000.0, effects=effects)), encoding="utf-8")
    with ended(start_identifier(f"aircraft:={file}"), said):
        probe.await_identifier()
    assert "the estimators do not correct for stall_separation" in said[0]
    assert "mass: 4000 kg at 18 m/s on 0.7875 m^2 need a lift coefficient of 256" in said[0]


def saved(probe: Probe) -> dict[str, Any]:
    """What a file holds that was asked for, which is the only one in a folder that was made for it."""
    answer = probe.ask(Trigger, "/identifier/save")
    assert answer.success, answer.message
    path = Path(answer.message)
    assert list(path.parent.iterdir()) == [path]
    return dict(json.loads(path.read_text(encoding="utf-8")))


@pytest.mark.slow
def test_parameters_save_and_reset(probe: Probe, tmp_path: Path) -> None:
    """Parameters describe themselves and refuse; a folder that cannot be written is said; a reset forgets all."""
    folder = tmp_path / "made" / "here"
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with identifier(f"save_directory:={tmp_path / 'file'}"):
        probe.await_identifier()
        request = DescribeParameters.Request(names=["publish_rate"])
        (described,) = probe.ask(DescribeParameters, "/identifier/describe_parameters", request).descriptors
        assert "[Hz]" in described.description
        assert "Default: 20.0" in described.description
        assert described.floating_point_range[0].to_value == 1000.0
        fixed = set_parameter(probe, "window", ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=5.0))
        assert not fixed.successful
        assert "takes effect when the node is configured" in fixed.reason
        empty = probe.ask(Trigger, "/identifier/save")
        assert not empty.success
        assert "no aligned sample" in empty.message
        probe.speak(made_up_streams(3.0))
        answer = probe.ask(Trigger, "/identifier/save")
        assert not answer.success
        assert "cannot be written" in answer.message
        text = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=str(folder))
        assert set_parameter(probe, "save_directory", text).successful
        content = saved(probe)
        assert probe.ask(Trigger, "/identifier/reset").success
        assert not probe.ask(Trigger, "/identifier/save").success
    assert [path.parent for path in tmp_path.rglob("*.json")] == [folder]
    assert content["aircraft"] == "cdrw"
    assert content["samples"] == 599
    assert content["settings"]["frequencies"] == list(OnlineSettings().frequencies)
    assert content["derivatives"].keys() == load_aircraft("cdrw").derivatives.keys()
    errors = {"standard_error", "statistical_error", "systematic_error"}
    assert content["derivatives"]["Cm_q"].keys() == {"value", *errors, "lower", "upper", "valid", "status"}


@pytest.mark.slow
def test_lifecycle_by_requests(probe: Probe) -> None:
    def state() -> str:
        return probe.ask(GetState, "/identifier/get_state").current_state.label

    def change(transition: int) -> bool:
        request = ChangeState.Request()
        request.transition.id = transition
        return probe.ask(ChangeState, "/identifier/change_state", request).success

    configure, cleanup, activate, deactivate, shutdown = 1, 2, 3, 4, 5
    with identifier("autostart:=false"):
        assert state() == "unconfigured"
        assert not change(99), "rclpy alone does not answer this, and the node ends"
        assert not change(activate)
        assert change(configure)
        assert state() == "inactive"
        assert change(activate)
        probe.await_identifier()
        probe.speak(made_up_streams(1.0))
        probe.until(lambda: probe.estimates)
        assert change(deactivate)
        assert change(cleanup)
        assert change(configure), "a second time"
        assert change(activate)
        assert change(deactivate)
        assert change(cleanup)
        assert change(shutdown)
        assert state() == "finalized"


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (['aircraft:=""'], "parameter aircraft is empty: give a name or a file, e.g. --ros-args -p aircraft:=cdrw"),
        (["publish_rate:=5"], "parameter publish_rate = 5 (integer): expected a double, 0.01 to 1000 Hz"),
        (["frequencies:=[3.0, 0.1, 1.0]"], "frequencies"),
    ],
)
def test_a_start_that_cannot_be_is_one_line_and_code_2(ros: None, parameters: list[str], words: str) -> None:
    process = start_identifier(*parameters)
    text, _ = process.communicate(timeout=60.0)
    assert process.returncode == 2, text
    assert len(text.strip().splitlines()) == 1, text
    assert words in text


def test_a_misspelt_parameter_and_an_aircraft_that_is_not_known_are_said(ros: None) -> None:
    process = start_identifier("aircraft:=nonesuch", "windwo:=3.0")
    text, _ = process.communicate(timeout=60.0)
    assert process.returncode == 2, text
    assert "'windwo' is not known and has no effect; did you mean 'window'?" in text
    assert "aircraft 'nonesuch' is not known" in text
    assert len(text.strip().splitlines()) == 2, text


@pytest.mark.slow
def test_malformed_ros_arguments_end_it_with_code_2(ros: None) -> None:
    process = start_identifier("aircraft:=")
    text, _ = process.communicate(timeout=60.0)
    assert process.returncode == 2, text
    assert "arguments after --ros-args" in text
    assert "Traceback" not in text
