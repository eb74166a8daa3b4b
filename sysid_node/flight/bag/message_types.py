"""The definitions of the message types in bags, for rosbags and for this package's own decoding."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from sysid_node.errors import InputError
from sysid_node.flight.cdr.layout import NUMBERS, Array, Definitions, Kind, Part, String


@cache
def type_store() -> Typestore:
    """Types of ROS 2 Jazzy and of sysid_msgs. Raises InputError where the .msg files of sysid_msgs are not found."""
    store = get_typestore(Stores.ROS2_JAZZY)
    folder = message_folder()
    for path in sorted(folder.glob("*.msg")):
        store.register(get_types_from_msg(path.read_text(encoding="utf-8"), f"sysid_msgs/msg/{path.stem}"))
    return store


@cache
def definitions_of(store: Typestore) -> Definitions:
    """The fields of the message types that a store of rosbags knows."""

    @cache
    def fields(msgtype: str) -> Sequence[tuple[str, Kind]]:
        return [(name, _kind(description)) for name, description in store.fielddefs[msgtype][1]]

    return fields


def _kind(description: FieldDesc) -> Kind:
    """The kind of a field, from rosbags' description of it."""
    node: Any = description[0]
    inner: Any = description[1]
    if node == Nodetype.BASE:
        return String() if inner[0] == "string" else NUMBERS[inner[0]]
    if node == Nodetype.NAME:
        return Part(inner)
    element, count = inner
    return Array(_kind(element), count if node == Nodetype.ARRAY else None)


def message_folder(source: Path = Path(__file__)) -> Path:
    """The folder with the .msg files of sysid_msgs: of the source tree that ``source`` is in, else as installed.

    The files are the only definition of the messages. Raises InputError where they are not found.
    """
    prefixes = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    folders = [source.resolve().parents[3] / "msg_defs" / "msg"]
    folders += [Path(prefix) / "share" / "sysid_msgs" / "msg" for prefix in prefixes if prefix]
    for folder in folders:
        if (folder / "AirData.msg").is_file():
            return folder
    raise InputError(
        "message definitions of sysid_msgs: not found in the source tree, AMENT_PREFIX_PATH or the Python "
        "environment; build the package sysid_msgs, or source the workspace that holds it"
    )
