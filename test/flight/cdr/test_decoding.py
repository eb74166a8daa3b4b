"""Messages decoded together. Truth: rosbags' own serialisation, message by message."""

from operator import attrgetter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.cdr.decoding import decode
from sysid_node.flight.cdr.layout import DamageError

JOINTS = "sensor_msgs/msg/JointState"
STORE = type_store()
DEFINITIONS = definitions_of(STORE)


def joint_state(sec, frame, names, *arrays):
    header = STORE.types["std_msgs/msg/Header"](STORE.types["builtin_interfaces/msg/Time"](sec, 7), frame)
    return STORE.types[JOINTS](header, names, *(np.array(values, np.float64) for values in arrays))


def raw_of(message, msgtype, little_endian=True):
    return bytes(STORE.serialize_cdr(message, msgtype, little_endian=little_endian))


names = st.lists(st.text(alphabet="abcé", max_size=9), max_size=4)
numbers = st.lists(st.floats(allow_nan=False), max_size=4)
joint_states = st.builds(joint_state, st.integers(-(2**31), 2**31 - 1), st.text(max_size=6), names, *[numbers] * 3)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(joint_states, st.booleans()), min_size=1, max_size=30))
def test_decodes_what_rosbags_wrote_whatever_the_layouts(messages):
    raw = [raw_of(message, JOINTS, little) for message, little in messages]
    seen = []
    for at, fields in decode(DEFINITIONS, JOINTS, raw):
        for i, place in enumerate(at):
            message, _ = messages[place]
            seen.append(place)
            assert fields.strings("name") == tuple(message.name)
            assert fields.strings("header.frame_id") == (message.header.frame_id,)
            for path in ("header.stamp.sec", "header.stamp.nanosec", "position", "velocity", "effort"):
                np.testing.assert_array_equal(fields.numbers(path)[i], attrgetter(path)(message))
    assert sorted(seen) == list(range(len(messages)))


def test_more_layouts_than_are_looked_for_are_still_read():
    raw = [raw_of(joint_state(i, f"{i:04d}", ["a"], [float(i)], [], []), JOINTS) for i in range(60)]
    positions = np.empty(60)
    groups = list(decode(DEFINITIONS, JOINTS, raw))
    for at, fields in groups:
        positions[at] = fields.numbers("position")[:, 0]
    assert positions.tolist() == list(range(60))
    assert len(groups) == 60


def test_one_group_where_the_layout_is_fixed():
    raw = [raw_of(joint_state(i, "x", ["a", "b"], [i, -i], [], []), JOINTS) for i in range(500)]
    ((at, fields),) = decode(DEFINITIONS, JOINTS, raw)
    assert at.size == 500
    assert fields.numbers("position")[:, 1].tolist() == [-float(i) for i in range(500)]


@pytest.mark.parametrize("cut", [0, 3, 4, 11, 21, -9, -1])
def test_a_message_cut_short_is_damaged(cut):
    raw = raw_of(joint_state(1, "x", ["a", "b"], [1, 2], [], [3, 4]), JOINTS)
    with pytest.raises(DamageError):
        list(decode(DEFINITIONS, JOINTS, [raw[:cut]]))


def test_a_length_beyond_the_message_is_damage():
    raw = bytearray(raw_of(joint_state(1, "x", ["a"], [1], [], []), JOINTS))
    raw[12:16] = b"\xff\xff\xff\x7f"
    with pytest.raises(DamageError):
        list(decode(DEFINITIONS, JOINTS, [bytes(raw)]))
