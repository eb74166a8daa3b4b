"""Aligned samples of a recording: all at once where that gives the same bits, else message by message.

``flight.align`` aligns all messages of a recording at once, for the batch methods. A replay uses it, too: where no
clock leapt and no topic lagged behind by more than the buffer, it gives the bits of ``streaming``. Aligning a bag of
60 s takes 0.01 s as a whole and 0.33 s message by message, which is why this one twin is kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.align import Alignment, Rejected, ScreenedMessages, align, buffer_ns
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps, Streams
from sysid_node.online.alignment.streaming import (
    KEPT_BUFFERS,
    AlignedSample,
    init,
    on_actuators,
    on_air_data,
    on_imu,
    stamp_of,
)
from sysid_node.online.types import SAMPLE_COLUMNS


class AlignedSamples(NamedTuple):
    """Samples in bulk: what feeding the messages one by one gives, to the last bit."""

    time: Array  # (N,) s
    samples: Array  # (N, M): SAMPLE_COLUMNS, the controls, and where commands are followed the controls' excess
    rejected: Rejected
    stamps: Stamps  # (N,) header stamps of the IMU messages, ns
    wait: Array  # (N,) s from each to the last of the messages that it lies before
    commands_from: int  # place of the first sample whose deflections follow from commands; N where none do


def align_streams(aircraft: Aircraft, streams: Streams, max_gap: float, carried: str = "positions") -> AlignedSamples:
    """The samples of a recording: all at once where clocks ran on and topics came together, else message by message."""
    bulk = align(aircraft, streams, max_gap, carried)
    if is_regular(bulk, streams, max_gap):
        return AlignedSamples(bulk.time, bulk.samples, bulk.rejected, bulk.stamps, bulk.wait, bulk.commands_from)
    return align_by_message(aircraft, streams, max_gap, carried)


def is_regular(bulk: Alignment, streams: Streams, max_gap: float) -> bool:
    """Whether no clock leapt, and no message had to wait for another for longer than the buffer holds it."""
    topics = (bulk.imu, *bulk.others)
    if any(topic.steps_back >= 0 or topic.steps_forward for topic in topics):
        return False
    decided = np.flatnonzero(
        (bulk.right[0] < bulk.others[0].stamps.size) & (bulk.right[1] < bulk.others[1].stamps.size)
    )
    imu, buffer = bulk.imu, buffer_ns(max_gap)
    if any(topic.stamps.size > 1 and int(np.diff(topic.stamps).max()) > buffer for topic in topics):
        return False  # a silence longer than the buffer: what waited for its end was given up before
    complete = imu.order[decided]  # when the last of the messages that a sample needs has come
    for other, right in zip(bulk.others, bulk.right, strict=True):
        complete = np.maximum(complete, other.order[right[decided]])
    dropped = _order_after(imu, imu.stamps[decided] + buffer)
    in_time = complete < dropped
    for other, right in zip(bulk.others, bulk.right, strict=True):
        left = np.maximum(right[decided] - 1, 0)
        in_time &= complete < _order_after(other, other.stamps[left] + KEPT_BUFFERS * buffer)
    return bool(in_time.all())


def _order_after(topic: ScreenedMessages, stamps: Stamps) -> Stamps:
    """When the first message stamped later than each of ``stamps`` came; far in the future where none did."""
    after = np.searchsorted(topic.stamps, stamps, side="right")
    return np.append(topic.order, np.iinfo(np.int64).max)[after]


def align_by_message(
    aircraft: Aircraft, streams: Streams, max_gap: float, carried: str = "positions"
) -> AlignedSamples:
    """Feeds the messages in the order in which they came."""
    state = init(aircraft, max_gap, carried)
    imu, air_data, actuators = streams.imu, streams.air_data, streams.actuators
    order = np.concatenate([stream.arrival.order for stream in (imu, air_data, actuators)])
    topics = np.repeat([0, 1, 2], [len(imu.arrival), len(air_data.arrival), len(actuators.arrival)])
    rows = np.concatenate([np.arange(np.count_nonzero(topics == topic)) for topic in (0, 1, 2)])
    stamps = [stream.arrival.stamp_ns.tolist() for stream in (imu, air_data, actuators)]
    values = [stream.tolist() for stream in (imu.values, air_data.values, actuators.positions)]
    complete: list[AlignedSample] = []
    sources: list[int] = []
    for place in np.argsort(order, kind="stable"):
        topic, row = int(topics[place]), int(rows[place])
        if topic == 0:
            new = on_imu(state, stamps[0][row], tuple(values[0][row]))
        elif topic == 1:
            new = on_air_data(state, stamps[1][row], tuple(values[1][row]))
        else:
            new = on_actuators(state, stamps[2][row], actuators.names, values[2][row])
        complete += new
        sources += [stamp_of(state, one.time) for one in new]
    width = max((len(one.sample) for one in complete), default=len(SAMPLE_COLUMNS) + len(aircraft.controls))
    time, wait = (np.array([one[i] for one in complete]) for i in (0, 2))
    samples = np.array([(*one.sample, *(0.0,) * (width - len(one.sample))) for one in complete])
    stamps_used = np.array(sources, np.int64)
    commands_from = int(np.searchsorted(time, state.commands_from))
    samples = samples.reshape(len(complete), width)
    return AlignedSamples(time, samples, state.rejected, stamps_used, wait, commands_from)
