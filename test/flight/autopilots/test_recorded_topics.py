"""Recordings of autopilots' topics: of several vehicles, of any namespace and name, and of what they lack."""

from dataclasses import replace

import numpy as np
import pytest
from mavros_bag import OUTPUTS, mavros1_bag, mavros_bag, without_definitions
from rosbags.rosbag2 import StoragePlugin
from simulated_logs import aircraft

from sysid_node.cli.main import main
from sysid_node.errors import InputError
from sysid_node.flight.align import flight_record
from sysid_node.flight.autopilots.base import AdapterSettings
from sysid_node.flight.autopilots.mavros import Mavros
from sysid_node.flight.autopilots.recorded import read_recorded
from sysid_node.flight.logs.checks.survey import survey
from sysid_node.flight.logs.opening import load_flight_record, open_log, read_autopilot_log

SECONDS = 3.0
KNOWN = replace(aircraft(), outputs=OUTPUTS)


def same(path, truth) -> None:
    """Two bags hold the same flight."""
    found, expected = (load_flight_record(one, KNOWN) for one in (path, truth))
    for name in ("time", *expected.columns):
        a, b = (getattr(one, name) if name == "time" else one[name] for one in (found, expected))
        np.testing.assert_array_equal(a - a[0] if name == "time" else a, b - b[0] if name == "time" else b)


@pytest.mark.parametrize("namespace", ["/uav1/mavros", "/uav1", "/fleet/seven/ap"])
def test_mavros_is_known_in_any_namespace(tmp_path, namespace):
    """Truth: the same messages under /mavros. MAVROS 2 takes its namespace from the launch file."""
    mavros_bag(tmp_path / "usual", seconds=SECONDS)
    mavros_bag(tmp_path / "own", seconds=SECONDS, namespaces=[namespace])
    same(tmp_path / "own", tmp_path / "usual")
    assert read_autopilot_log(tmp_path / "own").imu.source == "imu/data_raw"


def test_topics_of_two_vehicles_are_not_mixed(tmp_path):
    mavros_bag(tmp_path / "two", seconds=SECONDS, namespaces=["/uav1/mavros", "/uav2/mavros"])
    said = r"topics of several vehicles in it \(/uav1/mavros, /uav2/mavros\); keep those of one, e.g. rosbags-convert"
    with pytest.raises(InputError, match=said):
        load_flight_record(tmp_path / "two", KNOWN)


def test_of_two_vehicles_the_one_with_more_topics_is_taken(tmp_path):
    drop = ["/uav1/mavros/rc/out"]
    mavros_bag(tmp_path / "two", seconds=SECONDS, namespaces=["/uav1/mavros", "/uav2/mavros"], drop=drop)
    mavros_bag(tmp_path / "one", seconds=SECONDS, namespaces=["/uav2/mavros"])
    same(tmp_path / "two", tmp_path / "one")
    remarks = open_log(tmp_path / "two", outputs=OUTPUTS).remarks
    assert "topics of /uav1/mavros are left out: /uav2/mavros has more of what is needed" in remarks


def test_all_connections_of_a_topic_are_read(tmp_path):
    """Truth: the flight of a MAVROS that was not started again."""
    mavros1_bag(tmp_path / "whole.bag", SECONDS)
    mavros1_bag(tmp_path / "again.bag", SECONDS, restart=1.0)
    same(tmp_path / "again.bag", tmp_path / "whole.bag")
    assert load_flight_record(tmp_path / "again.bag", KNOWN).duration == pytest.approx(SECONDS, abs=0.1)


def test_the_content_decides_and_not_the_name(tmp_path):
    """Truth: the bags by their usual names."""
    for storage, suffix in ((StoragePlugin.SQLITE3, "db3"), (StoragePlugin.MCAP, "mcap")):
        mavros_bag(tmp_path / suffix, seconds=SECONDS, storage=storage)
        (file,) = (tmp_path / suffix).glob(f"*.{suffix}")
        (tmp_path / f"flight.{suffix}.orig").write_bytes(file.read_bytes())
        same(tmp_path / f"flight.{suffix}.orig", tmp_path / suffix)
    mavros1_bag(tmp_path / "flight.bag", SECONDS)
    (tmp_path / "flight").write_bytes((tmp_path / "flight.bag").read_bytes())
    same(tmp_path / "flight", tmp_path / "flight.bag")
    (tmp_path / "mcap").rename(tmp_path / "folder.bag")
    same(tmp_path / "folder.bag", tmp_path / "db3")


def test_a_bag_without_definitions_says_what_to_do(tmp_path):
    mavros_bag(tmp_path / "old", seconds=SECONDS)
    without_definitions(tmp_path / "old")
    with pytest.raises(InputError, match=r"bag old: no definition of mavros_msgs/msg/VfrHud in it; where its package"):
        load_flight_record(tmp_path / "old", KNOWN)


def test_a_bag_of_ros_1_that_was_cut_short_says_what_to_do(tmp_path):
    mavros1_bag(tmp_path / "flight.bag", SECONDS)
    whole = (tmp_path / "flight.bag").read_bytes()
    (tmp_path / "flight.bag").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"if it was cut short, run: rosbag reindex .*flight\.bag"):
        load_flight_record(tmp_path / "flight.bag", KNOWN)


def test_the_static_pressure_is_asked_for(tmp_path):
    """Without it there is no density, which makes the true airspeed of the equivalent one."""
    mavros_bag(tmp_path / "bag", seconds=SECONDS, drop=["imu/static_pressure"])
    said = "no /mavros/imu/static_pressure in it, which makes a true airspeed of /mavros/vfr_hud; record it too"
    assert survey(tmp_path / "bag", KNOWN).refusal.reasons[0] == said
    with pytest.raises(InputError, match=said):
        load_flight_record(tmp_path / "bag", KNOWN)


@pytest.mark.parametrize(
    ("drop", "said"),
    [
        (["vfr_hud"], "no /mavros/vfr_hud in it; record it too"),
        (["rc/out"], "no /mavros/rc/out in it; record it too"),
        (["imu/data", "imu/data_raw"], "no /mavros/imu/data_raw in it; record it too"),
    ],
)
def test_topics_that_lack_are_asked_for(tmp_path, drop, said):
    mavros_bag(tmp_path / "bag", seconds=SECONDS, drop=drop)
    assert survey(tmp_path / "bag", KNOWN).refusal.reasons[0] == said


def test_convert_by_the_adapter_takes_the_same_topics(tmp_path):
    """Truth: the flight that is read without ``--autopilot``, whose actuators' map is the same."""
    mavros1_bag(tmp_path / "flight.bag", SECONDS)
    settings = AdapterSettings(joints=OUTPUTS)
    read = flight_record(aircraft(), read_recorded(tmp_path / "flight.bag", Mavros(settings)), 0.2)
    expected = load_flight_record(tmp_path / "flight.bag", KNOWN)
    np.testing.assert_array_equal(read["q"], expected["q"][-len(read) :])
    options = ["--autopilot", "mavros", "--joints", OUTPUTS, "--quiet"]
    assert main(["convert", str(tmp_path / "flight.bag"), "--out", str(tmp_path / "out"), *options]) == 0
