"""The beginning of a bundled flight as a bag of its own: all topics, and the truth beside it."""

import shutil
from pathlib import Path

from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from sysid_node.flight.bag.message_types import type_store

BAGS = Path(__file__).resolve().parents[2] / "bags"


def short_bag(name: str, seconds: float, folder: Path) -> Path:
    """The messages of the first ``seconds`` of ``bags/NAME``, as they are, in ``folder/NAME``."""
    path = folder / name
    with Reader(BAGS / name) as whole, Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as short:
        added = {
            connection.topic: short.add_connection(connection.topic, connection.msgtype, typestore=type_store())
            for connection in whole.connections
        }
        for connection, log_ns, message in whole.messages(stop=whole.start_time + round(seconds * 1e9)):
            short.write(added[connection.topic], log_ns, message)
    shutil.copy(BAGS / f"{name}.truth.json", folder / f"{name}.truth.json")
    return path
