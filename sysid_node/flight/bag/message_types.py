"""Message types: the store that reads and writes bags without ROS."""

from __future__ import annotations

import os
import sys
from functools import cache
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from sysid_node.errors import InputError
from sysid_node.flight.cdr.decode import definitions_of
from sysid_node.flight.cdr.layout import Layout, layout_of


@cache
def type_store() -> Typestore:
    """Types of ROS 2 Jazzy and of sysid_msgs. Raises InputError where the .msg files of sysid_msgs are not found."""
    store = get_typestore(Stores.ROS2_JAZZY)
    folder = message_folder()
    for path in sorted(folder.glob("*.msg")):
        store.register(get_types_from_msg(path.read_text(encoding="utf-8"), f"sysid_msgs/msg/{path.stem}"))
    return store


def message_layout(store: Typestore, msgtype: str, message: Any) -> Layout:
    """The layout of a message once it is serialised."""
    return layout_of(definitions_of(store), msgtype, bytes(store.serialize_cdr(message, msgtype)))


def message_folder() -> Path:
    """Where the .msg files of sysid_msgs lie: in the source tree, else where that package is installed.

    The files are the definition; nothing repeats them. Raises InputError where they are not found.
    """
    prefixes = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    folders = [Path(__file__).resolve().parents[3] / "msg_defs" / "msg"]
    folders += [Path(prefix) / "share" / "sysid_msgs" / "msg" for prefix in prefixes if prefix]
    for folder in folders:
        if (folder / "AirData.msg").is_file():
            return folder
    raise InputError(
        "message definitions of sysid_msgs: not found in the source tree, AMENT_PREFIX_PATH or the Python "
        "environment; build the package sysid_msgs, or source the workspace that holds it"
    )
