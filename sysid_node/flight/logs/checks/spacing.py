"""Whether air data and actuators come often enough that the values at the IMU's times lie between two messages."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sysid_node.flight.align import MAX_GAP, bracket
from sysid_node.flight.logs.rates import rate_of, rate_text
from sysid_node.flight.streams import Stamps, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA

#: The rate (Hz) above which no step between messages is longer than ``MAX_GAP``.
LEAST_RATE = 1.0 / MAX_GAP

#: Faster topics than so many times this rate come often enough, but for single gaps, which are told as such.
_FAST = 2.0

#: The share of the IMU's messages that may be left out.
_FEW = 0.1


class SparseTopic(NamedTuple):
    """A topic that comes too seldom: its rate (Hz), and the share of the IMU's messages that are left out for it."""

    topic: str
    rate: float
    left_out: float

    @property
    def text(self) -> str:
        """The rate, the rate that is needed, and why, in one line."""
        many = "all" if self.left_out == 1.0 else f"{100.0 * self.left_out:.0f} %"
        return (
            f"{self.topic} comes at {rate_text(self.rate)} Hz, and more than {LEAST_RATE:g} Hz are needed: {many} of "
            f"the IMU's messages are left out, between messages more than {MAX_GAP:g} s apart (max_gap)"
        )


def sparse_topics(streams: Streams) -> dict[str, SparseTopic]:
    """The topics for which more than a tenth of the IMU's messages are left out, as they come too seldom."""
    imu = _increasing(streams.imu.arrival.stamp_ns)
    found = {}
    for topic in (AIR_DATA, ACTUATORS):
        stamps = _increasing(streams.by_topic[topic].arrival.stamp_ns)
        rate = rate_of(stamps)
        if not 0.0 < rate < _FAST * LEAST_RATE:
            continue
        between = imu[(imu >= stamps[0]) & (imu <= stamps[-1])]
        near = bracket(stamps, between, MAX_GAP)[1]
        left_out = 1.0 - float(near.mean()) if near.size else 0.0
        if left_out > _FEW:
            found[topic] = SparseTopic(topic, rate, left_out)
    return found


def _increasing(stamps: Stamps) -> Stamps:
    return np.unique(stamps[stamps > 0])
