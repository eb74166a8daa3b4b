"""What a log says of itself: when it was recorded, and by which vehicle.

PX4's logs hold the GPS receiver's UTC and the autopilot's unique number, ArduPilot's the GPS week and the board's
number, telemetry logs the ground station's clock, and bags the recorder's. A table says neither.
"""

from __future__ import annotations

import datetime
import re
import struct
from pathlib import Path
from typing import Any, NamedTuple

from sysid_node.flight.bag.reader import open_bag
from sysid_node.flight.bag.recordings import open_recording
from sysid_node.flight.logs.content import Content, content_of
from sysid_node.flight.logs.damage import reading_log
from sysid_node.flight.logs.readers.packages import quietly, required

#: Clocks before this were never set.
_CLOCK_SET = datetime.datetime(2000, 1, 1, tzinfo=datetime.UTC)
_UNIX = datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC)
_GPS = datetime.datetime(1980, 1, 6, tzinfo=datetime.UTC)
_LEAP_SECONDS = 18  # GPS time is ahead of UTC by so much since 2017 (IERS Bulletin C)
_BOARD = re.compile(r"(?:[0-9A-F]{8} ){2}[0-9A-F]{8}$")


class LogOrigin(NamedTuple):
    """``date``: the log's start in UTC, None where its clock was not set. ``vehicle``: a number, empty for none."""

    date: datetime.datetime | None
    vehicle: str


def log_origin(path: str | Path) -> LogOrigin:
    """When a log was recorded, and by which vehicle. Raises InputError where it is damaged or no log."""
    path, content = Path(path), content_of(path)
    if content is Content.ROSBAG2:
        with open_bag(path) as reader:
            return LogOrigin(_utc(reader.start_time / 1e9), "")
    with reading_log(path):
        if content is Content.ROSBAG1:
            with open_recording(path) as reader:
                return LogOrigin(_utc(reader.start_time / 1e9), "")
        if content is Content.ULOG:
            return _of_ulog(path)
        if content in (Content.DATAFLASH, Content.DATAFLASH_TEXT):
            return _of_dataflash(path, text=content is Content.DATAFLASH_TEXT)
        if content is Content.TELEMETRY:
            return LogOrigin(_utc(struct.unpack(">Q", path.open("rb").read(8))[0] / 1e6), "")
    return LogOrigin(None, "")


def _utc(seconds: float) -> datetime.datetime | None:
    """Seconds since 1970 as a date; None where a clock was never set."""
    date = _UNIX + datetime.timedelta(seconds=min(max(seconds, 0.0), 4e9))
    return date if date >= _CLOCK_SET else None


def _of_ulog(path: Path) -> LogOrigin:
    core = required("pyulog.core", "PX4's logs")
    with quietly():
        log = core.ULog(str(path), ["vehicle_gps_position", "sensor_gps"])
    vehicle = str(log.msg_info_dict.get("sys_uuid", ""))
    for topic in log.data_list:
        known = [i for i, utc in enumerate(topic.data.get("time_utc_usec", ())) if utc > 0]
        if known:
            since = int(topic.data["timestamp"][known[0]]) - int(log.start_timestamp)
            return LogOrigin(_utc((int(topic.data["time_utc_usec"][known[0]]) - since) / 1e6), vehicle)
    return LogOrigin(None, vehicle)


def _of_dataflash(path: Path, *, text: bool) -> LogOrigin:
    reader = required("pymavlink.DFReader", "ArduPilot's logs")
    date, vehicle = None, ""
    with quietly():
        log = (reader.DFReader_text if text else reader.DFReader_binary)(str(path))
        while date is None or not vehicle:
            message = log.recv_match(type=["GPS", "MSG"])
            if message is None:
                break
            row: dict[str, Any] = message.to_dict()
            if row["mavpackettype"] == "MSG":
                found = _BOARD.search(str(row.get("Message", "")).strip())
                vehicle = found[0].replace(" ", "") if found else vehicle
            elif row.get("GWk", 0) and date is None:
                seconds = row["GWk"] * 604800 + row["GMS"] / 1000 - _LEAP_SECONDS - float(row.get("TimeUS", 0)) / 1e6
                date = _GPS + datetime.timedelta(seconds=seconds)
    return LogOrigin(date, vehicle)
