"""The messages of the three input topics as arrays, before any message is aligned or rejected."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError
from sysid_node.flight.record import Array
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

Stamps = NDArray[np.int64]

#: The joints carry commands to servos and motors, not measured positions.
COMMANDS = "commands"

#: As ``COMMANDS``, but one "joint" a control, as a fraction of the full command: -1..1 with the sign of the aircraft
#: file's control (trailing edge down, right trailing edge down, trailing edge left), and the throttle 0..1.
COMMAND_FRACTIONS = "command_fractions"


@dataclass(frozen=True)
class Arrival:
    """Stamps, log times and order of the N messages of a topic, in log order."""

    stamp_ns: Stamps  # (N,) of the headers, ns
    log_ns: Stamps  # (N,) when each was recorded, ns
    order: Stamps  # (N,) place among the messages of all topics

    def __len__(self) -> int:
        return int(self.stamp_ns.size)


@dataclass(frozen=True)
class Stream:
    """The messages of one topic.

    ``source`` is the topic's own name in the log, and ``remedy`` the setting of the autopilot that raises its rate.
    """

    arrival: Arrival
    source: str = field(default="", kw_only=True)
    remedy: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class ImuStream(Stream):
    """IMU messages, FRD."""

    values: Array  # (N, 6) ax ay az m/s^2, p q r rad/s
    attitude: Array  # (N, 3) phi theta psi rad, NaN = not given
    frame_id: str = ""


@dataclass(frozen=True)
class AirDataStream(Stream):
    """Air data messages; NaN = not measured."""

    values: Array  # (N, 4) V m/s, alpha rad, beta rad, rho kg/m^3


@dataclass(frozen=True)
class JointStream(Stream):
    """Joint state messages; NaN where a message lacks a joint that others have.

    ``content`` is the ``frame_id`` of the messages in a bag: ``COMMANDS`` or ``COMMAND_FRACTIONS`` where a log of an
    autopilot was converted, otherwise empty. ``interval`` (s) is that between the commands of a log where lines stand
    between them; 0 = every message is there as it was recorded.
    """

    names: tuple[str, ...]
    positions: Array  # (N, J) rad; throttle 0..1 or N
    content: str = ""
    interval: float = 0.0


@dataclass(frozen=True)
class Streams:
    """A flight as recorded, or a ``piece`` of one; ``name`` stands in error messages.

    Raises InputError where a topic of a whole flight has no messages.
    """

    imu: ImuStream
    air_data: AirDataStream
    actuators: JointStream
    name: str = ""
    piece: bool = False

    def __post_init__(self) -> None:
        for topic, stream in self.by_topic.items():
            if not len(stream.arrival) and not self.piece:
                raise InputError(f"{self.name}: no messages on {topic}; record that topic too")

    @property
    def by_topic(self) -> dict[str, Stream]:
        """The streams by topic."""
        return {IMU: self.imu, AIR_DATA: self.air_data, ACTUATORS: self.actuators}


def arrivals_in_stamp_order(*stamps_ns: Stamps) -> list[Arrival]:
    """Arrivals of topics whose messages arrived when they were stamped; at equal stamps in the order of the topics."""
    every = np.concatenate(stamps_ns)
    order = np.empty(every.size, np.int64)
    order[np.argsort(every, kind="stable")] = np.arange(every.size)
    ends = np.cumsum([stamps.size for stamps in stamps_ns])[:-1]
    return [Arrival(stamps, stamps, place) for stamps, place in zip(stamps_ns, np.split(order, ends), strict=True)]


def in_order_of_logging(streams: Streams) -> Streams:
    """The streams with the order among all messages that follows from when each was logged."""
    logged = [stream.arrival.log_ns for stream in streams.by_topic.values()]
    every = np.concatenate(logged)
    order = np.empty(every.size, np.int64)
    order[np.argsort(every, kind="stable")] = np.arange(every.size)
    ends = np.cumsum([times.size for times in logged])[:-1]
    arrivals = [
        replace(stream.arrival, order=place)
        for stream, place in zip(streams.by_topic.values(), np.split(order, ends), strict=True)
    ]
    return replace(
        streams,
        imu=replace(streams.imu, arrival=arrivals[0]),
        air_data=replace(streams.air_data, arrival=arrivals[1]),
        actuators=replace(streams.actuators, arrival=arrivals[2]),
    )
