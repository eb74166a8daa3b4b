"""Messages put together of parts. Truth: rosbags' own serialisation."""

import numpy as np
import pytest

from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.cdr.template import Templates
from sysid_node.flight.topics import DERIVATIVES_TYPE

STORE = type_store()
JOINTS, IMU = "sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu"


def templates() -> Templates:
    return Templates(definitions_of(STORE))


def test_numbers_that_are_written_are_read_by_rosbags():
    values = (((0, 0), "frame of odd length"), ("elevator", "aileron"), (0.0, 0.0), (), (1.0,))
    template = templates().template(JOINTS, values)
    numbers = np.array([[0.1, 0.2, 7.0], [np.nan, -3.0, 8.0]])
    found = template.write(i4=np.array([[5], [6]]), f8=numbers)
    read = [STORE.deserialize_cdr(data, JOINTS) for data in found]
    assert [m.header.stamp.sec for m in read] == [5, 6]
    assert [m.name for m in read] == [["elevator", "aileron"]] * 2
    np.testing.assert_array_equal([[*m.position, *m.effort] for m in read], numbers)
    assert [m.velocity.size for m in read] == [0, 0]


def test_arrays_of_fixed_length_have_none_before_them():
    none = (0.0,) * 9
    values = (((3, 4), "imu"), (0.0, 0.0, 0.0, 1.0), none, (1.0, 2.0, 3.0), none, (4.0, 5.0, 6.0), (*none[1:], 7.0))
    message = STORE.deserialize_cdr(templates().template(IMU, values).text, IMU)
    assert (message.header.stamp.nanosec, message.angular_velocity.z) == (4, 3.0)
    assert message.linear_acceleration_covariance[-1] == 7.0


def estimates(words: list[str]) -> tuple[object, ...]:
    """Values of a message of estimates with these statuses."""
    derivatives = tuple(
        (f"C_{'x' * i}", float(i), 2.0, 1.5, 1.3, 3.0, 4.0, word == "ok", word) for i, word in enumerate(words)
    )
    fits = (("Cm", 0.9, 1e-3, 7.5, 12),)
    return ((1, 2), "base_link"), "cdrw", "iv_rft", derivatives, fits, derivatives[:2]


def by_rosbags(words: list[str]) -> bytes:
    """The same message as rosbags serialises it."""
    types = STORE.types
    (stamp, frame), aircraft, method, derivatives, fits, servos = estimates(words)
    message = types[DERIVATIVES_TYPE](
        types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](*stamp), frame),
        aircraft,
        method,
        [types["sysid_msgs/msg/DerivativeEstimate"](*row) for row in derivatives],
        [types["sysid_msgs/msg/FitQuality"](*row) for row in fits],
        [types["sysid_msgs/msg/DerivativeEstimate"](*row) for row in servos],
    )
    return bytes(STORE.serialize_cdr(message, DERIVATIVES_TYPE))


@pytest.mark.parametrize("seed", range(5))
def test_parts_that_were_made_before_lie_where_they_must(seed: int):
    """Statuses of all lengths move all that comes after them; one maker remembers the parts of all messages."""
    rng, maker = np.random.default_rng(seed), templates()
    for _ in range(40):
        words = ["ok" if i % 3 else "n" * int(i) for i in rng.integers(0, 20, rng.integers(0, 9))]
        assert maker.template(DERIVATIVES_TYPE, estimates(words)).text == by_rosbags(words)
