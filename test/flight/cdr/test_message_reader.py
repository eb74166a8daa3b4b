"""Single messages. Truth: rosbags' own serialisation."""

from collections.abc import Callable

import numpy as np
import pytest

from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.cdr.layout import DamageError
from sysid_node.flight.cdr.message_reader import MessageReader

STORE = type_store()
FIELDS = definitions_of(STORE)
JOINTS = "sensor_msgs/msg/JointState"
STAMP = ("header.stamp.sec", "header.stamp.nanosec")


def joints(names: list[str], positions: list[float], seconds: int = 7, big: bool = False) -> bytes:
    time = STORE.types["builtin_interfaces/msg/Time"](seconds, 250)
    header = STORE.types["std_msgs/msg/Header"](time, "frame of odd length")
    message = STORE.types[JOINTS](header, names, np.array(positions, float), np.empty(0), np.array([1.0]))
    return bytes(STORE.serialize_cdr(message, JOINTS, little_endian=not big))


def test_numbers_and_strings_are_those_that_were_written() -> None:
    reader = MessageReader(FIELDS, JOINTS, (*STAMP, "position"), ("name", "header.frame_id"))
    for seconds, names in ((1, ["elevator", "aileron"]), (2, ["a", "throttle"]), (3, ["elevator", "aileron"]), (4, [])):
        positions = [0.125 * seconds, -1e-300][: len(names)]
        numbers, strings = reader.read(joints(names, positions, seconds))
        assert numbers == (seconds, 250, *positions)
        assert strings == (tuple(names), "frame of odd length")


def test_other_byte_orders_and_more_layouts_than_are_remembered() -> None:
    reader = MessageReader(FIELDS, JOINTS, (*STAMP, "position"), ("name",))
    for i in range(60):
        names = [f"{'x' * (i % 25)}{i % 20}", "rudder"]
        numbers, strings = reader.read(joints(names, [i, -i], i, big=i % 3 == 0))
        assert (numbers, strings) == ((i, 250, i, -i), (tuple(names),))


@pytest.mark.parametrize("spoil", [lambda raw: raw[:-9], lambda raw: b"", lambda raw: b"\1" + raw])
def test_what_is_no_whole_message_is_refused(spoil: Callable[[bytes], bytes]) -> None:
    reader = MessageReader(FIELDS, JOINTS, (*STAMP, "position"))
    raw = joints(["elevator"], [0.5])
    reader.read(raw)
    with pytest.raises(DamageError):
        reader.read(spoil(raw))


def test_bytes_behind_a_message_mean_nothing() -> None:
    """ROS serialises into buffers that may be larger than the message."""
    reader = MessageReader(FIELDS, JOINTS, (*STAMP, "position"))
    for extra in (b"", b"\1" * 8, b"\2" * 3):
        assert reader.read(joints(["elevator"], [0.5]) + extra)[0] == (7, 250, 0.5)
