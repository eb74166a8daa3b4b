"""A flight in closed loop, recorded over DDS, replays to the estimates that the live node published."""

import contextlib
import signal
from pathlib import Path

import numpy as np
import pytest
from due_times import due_times
from harness import LOSSLESS, Probe, ended, start, start_identifier
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.bag.reader import read_streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.ros.support.conversion import estimates_from_message, stamp_ns

SECONDS = 5.0


@pytest.mark.slow
def test_a_bag_of_the_loop_replays_to_the_same_estimates(probe: Probe, tmp_path: Path) -> None:
    """To the last bit, at every time at which both published: the same messages make the same estimates."""
    bag = tmp_path / "flight"
    slow = ("-p", "rate:=50.0", "-p", "aircraft:=cdrw")  # nothing is lost on a busy machine
    lossless = [word for pair in LOSSLESS for word in ("-p", pair)]
    with contextlib.ExitStack() as stack:
        stack.enter_context(ended(start_identifier("method:=sls_rft")))
        stack.enter_context(ended(start("recorder", str(bag), "--ros-args", *lossless)))
        probe.until(lambda: probe.node.count_subscribers("/imu/data") >= 2)
        probe.spin(0.5)
        stack.enter_context(ended(start("adaptive_controller", "--ros-args", "-p", "aircraft:=cdrw")))
        stack.enter_context(ended(start("flight_simulator", "--ros-args", *slow)))
        probe.until(lambda: len(probe.estimates) > SECONDS * 20.0, 120.0)
    aircraft, settings = load_aircraft("cdrw"), OnlineSettings(method="sls_rft")
    aligned = align_streams(aircraft, read_streams(bag), settings.max_gap)
    due = due_times(aligned.time, aligned.wait, 20.0)
    stamps = aligned.stamps[np.searchsorted(aligned.time, due)].tolist()
    desk = dict(zip(stamps, run(aircraft, settings, aligned.time, aligned.samples, due), strict=True))
    live = {stamp_ns(message.header.stamp): message for message in probe.estimates}
    both = sorted(desk.keys() & live.keys())
    assert len(both) >= 0.9 * SECONDS * 20.0
    for stamp in both:
        heard = estimates_from_message(live[stamp], 0).derivatives
        assert repr(heard) == repr(dict(desk[stamp].derivatives)), stamp


def test_a_bag_that_exists_is_left_alone(tmp_path: Path) -> None:
    process = start("recorder", str(tmp_path))
    text, _ = process.communicate(timeout=60.0)
    assert process.returncode == 2
    assert "exists already" in text
    assert "Traceback" not in text


def test_it_says_how_much_was_recorded_and_what_is_missing(tmp_path: Path, probe: Probe) -> None:
    said: list[Log] = []
    kept = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    probe.node.create_subscription(Log, "/rosout", said.append, kept)
    process = start("recorder", str(tmp_path / "empty"))
    assert process.stdout is not None
    assert "records into" in process.stdout.readline()
    # rcl prints the line before it publishes it on /rosout, and complains of a signal in between
    probe.until(lambda: any("records into" in log.msg for log in said))
    process.send_signal(signal.SIGINT)
    text, _ = process.communicate(timeout=60.0)
    assert "recorded 0 messages of 0 topics; nothing came on /imu/data, /air_data, /actuators" in text
    assert len(text.splitlines()) == 1, text
