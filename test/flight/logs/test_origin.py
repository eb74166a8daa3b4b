"""What logs say of themselves: the date and the vehicle."""

import datetime
from pathlib import Path

import numpy as np
import pytest
from ulog_file import Topic, write_ulog

from sysid_node.errors import InputError
from sysid_node.flight.logs.origin import log_origin

START = datetime.datetime(2026, 5, 3, 9, 30, tzinfo=datetime.UTC)
BAGS = Path(__file__).resolve().parents[3] / "bags"


def test_a_px4_log_has_the_gps_receivers_utc(tmp_path: Path) -> None:
    """The receiver knows the time 7 s after the log's start, and not before."""
    us = np.array([5_000_000, 8_000_000, 12_000_000])
    utc = np.array([0, 0, int(START.timestamp() * 1e6) + 7_000_000])
    write_ulog(tmp_path / "a.ulg", [Topic("sensor_gps", us, {"time_utc_usec": ("uint64_t", utc)})], {}, 0)
    assert log_origin(tmp_path / "a.ulg").date == START


def test_a_px4_log_without_gps_has_no_date(tmp_path: Path) -> None:
    us = np.array([5_000_000, 8_000_000])
    write_ulog(tmp_path / "a.ulg", [Topic("sensor_gps", us, {"time_utc_usec": ("uint64_t", np.zeros(2, int))})], {}, 0)
    assert log_origin(tmp_path / "a.ulg") == (None, "")


def test_a_bag_has_the_recorders_clock() -> None:
    date = log_origin(BAGS / "cdrw_multistep").date
    assert date is not None
    assert date.isoformat(timespec="seconds") == "2026-01-01T00:00:00+00:00"


def test_a_telemetry_log_has_the_ground_stations_clock(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(int(START.timestamp() * 1e6).to_bytes(8, "big") + b"\xfd" + bytes(20))
    assert log_origin(path) == (START, "")


def test_a_table_says_neither(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,p\n0,1\n")
    assert log_origin(tmp_path / "a.csv") == (None, "")


def test_a_file_that_is_no_log_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.ulg").write_bytes(b"ULog\x01\x12\x35\x01")
    with pytest.raises(InputError):
        log_origin(tmp_path / "a.ulg")
