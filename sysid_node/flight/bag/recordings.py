"""Recordings of any topics, of ROS 1 or 2, opened for reading message by message."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from sysid_node.errors import InputError
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.storage_files import checked_files


@contextmanager
def open_recording(path: Path) -> Iterator[AnyReader]:
    """A bag that is open for reading. Raises InputError, one line with a remedy, for every error in reading it."""
    try:
        with ExitStack() as stack:
            files = stack.enter_context(checked_files(path))
            yield stack.enter_context(AnyReader([files], default_typestore=type_store()))
    except InputError:
        raise
    except Exception as error:  # parsers of a damaged file raise all kinds of exceptions
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"bag {path.name}: cannot be read: {words}; {_remedy(path)}") from error


def _remedy(path: Path) -> str:
    if path.is_file():
        with path.open("rb") as file:
            if file.read(7) == b"#ROSBAG":
                return f"if it was cut short, run: rosbag reindex {path}; or record it again"
    return "give a rosbag2 folder, .mcap, .db3 or .bag file; record it again, or repair it"


def require_definitions(reader: AnyReader, connections: Sequence[Connection], name: str) -> None:
    """Raise InputError, which names the bag, where the definition of a message is neither in it nor known."""
    for connection in connections:
        if connection.msgtype not in reader.typestore.fielddefs:
            raise InputError(
                f"bag {name}: no definition of {connection.msgtype} in it; where its package is installed, convert the "
                "bag to mcap, which holds definitions: ros2 bag convert (storage_id: mcap)"
            )
