"""The live view over DDS: what is published stands in the recording."""

from importlib.util import find_spec
from time import monotonic

import numpy as np
import pytest
from rrd import Recorded

if find_spec("rclpy") is None:
    pytest.skip("ROS is not installed", allow_module_level=True)

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import Imu, JointState
from sysid_msgs.msg import AirData, DerivativeEstimate, DerivativeEstimates

import sysid_node.ros  # finds sysid_msgs in a virtual environment
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.live.ros_domain import own_domain
from sysid_node.online import types
from sysid_node.ros.support.conversion import header
from sysid_node.ros.support.flight_watch import FlightWatch
from sysid_node.view.live import LiveScene
from sysid_node.view.recording import append, open_file, say

assert sysid_node.ros
own_domain()
START = 1_700_000_000_000_000_000


def publish(node, at: float, publishers: dict) -> None:
    """One message of each kind, stamped so many seconds after the start: level flight along 20 m/s, heading east."""
    stamp = header(START + round(1e9 * at), "base_link")
    imu = Imu(header=stamp)
    imu.linear_acceleration.z = 9.8
    imu.angular_velocity.y = -0.1  # forward-left-up: the nose rises at 0.1 rad/s
    imu.orientation.w = 1.0
    publishers["imu"].publish(imu)
    publishers["air"].publish(AirData(header=stamp, true_airspeed=20.0, angle_of_attack=0.0, air_density=1.2))
    moved = 0.2 if at >= 1.0 else 0.0
    names, positions = ["elevator", "aileron", "rudder", "throttle"], [moved, 0.0, 0.0, 0.5]
    publishers["joints"].publish(JointState(header=stamp, name=names, position=positions))
    d = DerivativeEstimate(name="Cm_de", value=-0.46, lower=-0.46 - 1 / (1 + at), upper=-0.46 + 1 / (1 + at))
    d.valid, d.status = at >= 1.0, "ok" if at >= 1.0 else "not excited"
    publishers["estimates"].publish(DerivativeEstimates(header=stamp, aircraft="cdrw", derivatives=[d]))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """Two seconds of a flight, published and shown."""
    path = tmp_path_factory.mktemp("live") / "live.rrd"
    if not rclpy.ok():
        rclpy.init()
    node, watch, scene = rclpy.create_node("flight"), FlightWatch(), LiveScene(load_aircraft("cdrw"))
    kinds = {"imu": (Imu, "imu/data"), "air": (AirData, "air_data"), "joints": (JointState, "actuators"),
             "estimates": (DerivativeEstimates, "identifier/derivatives"),
             "faults": (DiagnosticArray, "fault_monitor/faults")}  # fmt: skip
    publishers = {name: node.create_publisher(kind, topic, 100) for name, (kind, topic) in kinds.items()}
    stream = open_file(scene.declared, path)
    end = monotonic() + 60.0
    while not all(publisher.get_subscription_count() for publisher in publishers.values()):
        assert monotonic() < end
        watch.listen(0.05)
    watch.listen(0.3)
    for at in np.arange(0.0, 2.0, 0.02):
        publish(node, float(at), publishers)
        if round(at, 2) == 1.5:
            status = DiagnosticStatus(name="fault_monitor: elevator", message="elevator: stuck")
            publishers["faults"].publish(DiagnosticArray(status=[status]))
        watch.listen(0.005)
        if round(at / 0.02) % 10 == 9:
            watch.listen(0.1)
            news = scene.update(watch.start_ns, *watch.take(), watch.faults)
            append(stream, news)
            say(stream, news.about)
    watch.close()
    node.destroy_node()
    stream.flush()
    stream.disconnect()
    return Recorded(path)


@pytest.mark.slow
def test_what_was_published_is_shown_at_its_stamps(recorded: Recorded) -> None:
    time, airspeed = recorded.curve("/flight/airspeed/airspeed")
    np.testing.assert_allclose(airspeed, 20.0)
    _, pitch_rate = recorded.curve("/flight/rates/pitch_rate")
    np.testing.assert_allclose(pitch_rate, np.degrees(0.1))
    assert time[0] == pytest.approx(0.0, abs=1e-6)
    assert time[-1] > 1.7


def test_the_bands_narrow(recorded: Recorded) -> None:
    time, upper = recorded.curve("/derivatives_pitch/Cm_de/upper_95")
    np.testing.assert_allclose(upper, -0.46 + 1 / (1 + time), rtol=1e-6)
    _, shown = recorded.curve("/derivatives_pitch/Cm_de/estimate")
    np.testing.assert_array_equal(np.isfinite(shown), time >= 1.0)


def test_the_aircraft_flies_on_east(recorded: Recorded) -> None:
    """Orientation 1 in east-north-up is a heading of east: 20 m/s for the seconds that were heard."""
    time, position = recorded.vectors("/world/measured", "translation")
    order = np.argsort(time, kind="stable")
    time, position = time[order], position[order]
    np.testing.assert_allclose(position[-1] - position[0], [0.0, 20.0 * (time[-1] - time[0]), 0.0], atol=0.5)


def test_what_no_manoeuvre_helps_is_said_apart() -> None:
    """Statuses as of the identifier; what to do about them is in the reference."""
    scene = LiveScene(load_aircraft("cdrw"))
    statuses = {"Cm_de": "de not on time", "Cl_p": "not excited", "CL_q": "converging", "Cm_q": "ok"}
    derivatives = {
        name: types.DerivativeEstimate(name, 1.0, 0.1, 0.8, 1.2, status == "ok", status)
        for name, status in statuses.items()
    }
    text = scene.words(types.Estimates(12.0, derivatives, {}))
    assert "**Move the elevator**: CL_q (converging)." in text
    assert "**Move the aileron**: Cl_p (not excited)." in text
    assert "**Manoeuvres do not help**: Cm_de (de not on time)." in text


def test_what_moves_fails_and_is_missing_is_said(recorded: Recorded) -> None:
    assert "moves" in recorded.texts("/lanes/elevator", "state")
    assert recorded.texts("/lanes/fault_elevator", "state") == ["elevator: stuck"]
    about = recorded.texts("/about", "text")
    assert any("Move the elevator" in text and "Cm_de (not excited)" in text for text in about)
    assert "1 of 1 valid" in about[-1]
