"""Commands out of a bag: written message by message through rosbags, read back in log order."""

from pathlib import Path

import numpy as np
from made_flights import header, made_streams

from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.writer import add_topic, new_bag, write_streams
from sysid_node.flight.commands import COMMANDS, COMMANDS_TYPE, JointMessage, read_commands

TOLD = [
    JointMessage(2_000_000_000, 1_999_000_000, ("elevator", "rudder"), (0.1, -0.2)),
    JointMessage(2_500_000_000, 0, ("elevator",), (0.3,)),
    JointMessage(3_000_000_000, 2_999_000_000, ("elevator", "rudder"), (0.4, 0.5)),
]


def test_every_message_with_its_own_joints(tmp_path: Path) -> None:
    """Messages of several layouts, an unstamped one among them; the bag holds them out of order."""
    store, none = type_store(), np.zeros(0)
    with new_bag(tmp_path / "bag") as writer:
        topic = add_topic(writer, COMMANDS, COMMANDS_TYPE)
        for one in (TOLD[2], TOLD[0], TOLD[1]):
            head = header(store, "")
            head.stamp.sec, head.stamp.nanosec = divmod(one.stamp_ns, 1_000_000_000)
            message = store.types[COMMANDS_TYPE](head, list(one.names), np.array(one.positions), none, none)
            writer.write(topic, one.log_ns, bytes(store.serialize_cdr(message, COMMANDS_TYPE)))
    assert read_commands(tmp_path / "bag") == TOLD


def test_a_bag_without_any(tmp_path: Path) -> None:
    write_streams(tmp_path / "bag", made_streams(1.0))
    assert read_commands(tmp_path / "bag") == []
