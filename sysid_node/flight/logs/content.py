"""What kind of flight a file or a folder holds, told by its first bytes and not by its name."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from enum import Enum
from pathlib import Path

from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.frames import BodyFrame
from sysid_node.flight.topics import topic_names


class Content(Enum):
    """A kind of file that holds a flight; the value is its name in messages."""

    ROSBAG2 = "rosbag2 recording"
    ROSBAG1 = "ROS 1 bag"
    ULOG = "PX4 ULog"
    DATAFLASH = "ArduPilot DataFlash log"
    DATAFLASH_TEXT = "ArduPilot DataFlash log as text"
    TELEMETRY = "MAVLink telemetry log"
    TABLE = "CSV table"


_MAGIC = (
    (b"ULog\x01\x12\x35", Content.ULOG),
    (b"#ROSBAG V2.0", Content.ROSBAG1),
    (b"\x89MCAP0\r\n", Content.ROSBAG2),
    (b"SQLite format 3\x00", Content.ROSBAG2),
    (b"\xa3\x95", Content.DATAFLASH),
    (b"FMT, ", Content.DATAFLASH_TEXT),
)

#: First bytes of MAVLink messages of version 1 and 2. In a telemetry log each follows a time stamp of 8 bytes.
_MAVLINK = (0xFE, 0xFD)


def content_of(path: str | Path) -> Content:
    """What a path holds. A folder and a missing path count as a bag, whose reader says what is wrong with it.

    Raises InputError where a file is empty, cannot be read or is none of ``Content``.
    """
    path = Path(path)
    if path.is_dir():
        return Content.ROSBAG2
    if not path.exists():
        return Content.TABLE if path.suffix.lower() == ".csv" else Content.ROSBAG2
    if not path.is_file():  # a pipe or a device, which the table's reader refuses
        return Content.TABLE
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    found = next((content for magic, content in _MAGIC if head.startswith(magic)), None)
    if found is None and len(head) > 8 and head[8] in _MAVLINK and b"\x00" in head[:8]:
        found = Content.TELEMETRY
    if found is None and path.suffix.lower() in {".mcap", ".db3"}:
        found = Content.ROSBAG2  # damaged; its reader says how to repair it
    if found is None and (path.suffix.lower() == ".csv" or _is_text(head)):
        found = Content.TABLE
    if found is None:
        what = "is empty" if not head else "is no flight that can be read"
        raise InputError(f"{path}: {what}; expected a bag (ROS 1 or 2), .ulg, .bin, .tlog or CSV")
    return found


def remapped(path: str | Path, topics: Mapping[str, str] | None) -> bool:
    """Whether the input topics (as of ``topic_names``) have other names than usual.

    Raises InputError where they have and the path holds no bag, or one of ROS 1.
    """
    if topics is None or dict(topics) == topic_names():
        return False
    content = content_of(path)
    if content is not Content.ROSBAG2:
        raise InputError(f"--topic is for bags of ROS 2; {path} is a {content.value}; leave it out")
    return True


def say_that_axes_are_known(path: str | Path, frame: BodyFrame, what: str) -> None:
    """Warn (InputWarning) where other axes than usual were asked for, but the file, a ``what``, has its own."""
    if frame != "flu":
        warnings.warn(
            f"--body-frame is for bags of our own topics; {path} is a {what}, whose axes are known: it changes nothing",
            InputWarning,
            stacklevel=3,
        )


def _is_text(head: bytes) -> bool:
    """Whether bytes look like a table: text with a comma in its first line."""
    first = head.split(b"\n", 1)[0]
    return b"," in first and all(byte in b"\t\r\n" or 32 <= byte < 127 for byte in first.lstrip(b"\xef\xbb\xbf"))
