"""Reads ROS recordings, ROS 1 or 2, of an autopilot's own topics: MAVROS 1 and 2, PX4 and ROSflight.

The messages are converted by the functions of the live adapter (``flight.autopilots``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import Adapter, AdapterSettings, AirSample, ImuSample, JointSample
from sysid_node.flight.autopilots.known import ADAPTERS
from sysid_node.flight.autopilots.mavros import ATTITUDE as MAVROS_ATTITUDE
from sysid_node.flight.autopilots.mavros import IMU as MAVROS_IMU
from sysid_node.flight.autopilots.recorded import LoggedSample
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, IMU, AutopilotLog, LoggedCommands, Signal, absent
from sysid_node.flight.record import Array

_RATE = {
    "mavros": "request the message at a higher rate (service /mavros/set_message_interval)",
    "px4": "add it to dds_topics.yaml without rate_limit",
    "rosflight": "raise the firmware's parameter STRM_*",
}


class _Chosen(NamedTuple):
    """The connections of a recording that an adapter hears, and the adapter's own names of their topics."""

    autopilot: str
    connections: Mapping[int, tuple[str, ...]]  # connection -> topics of the adapter


def autopilot_of(topics: Mapping[str, str]) -> str | None:
    """The autopilot whose topics (name -> type) are recorded, at least two of them; None where there is none."""
    counts = {
        name: len({ours for topic in topics if (ours := _ours(topic, adapter)) is not None})
        for name, adapter in ADAPTERS.items()
    }
    best = max(counts, key=lambda name: counts[name])
    return best if counts[best] >= 2 else None


def _ours(topic: str, adapter: type[Adapter]) -> str | None:
    """The adapter's name of a recorded topic: without the version that PX4 appends, or a namespace before it."""
    bare = re.sub(r"_v\d+$", "", topic)
    for ours, others in {name: (name, *adapter.aliases.get(name, ())) for name in adapter.topics}.items():
        for name in others:
            spaced = name.startswith(("/mavros/", "/fmu/")) and bare.endswith(name)
            if bare == name or spaced:
                return ours
    return None


def read_autopilot_bag(path: str | Path, settings: AdapterSettings | None = None) -> AutopilotLog:
    """The signals of a bag of an autopilot's topics. Raises InputError where it is damaged, or holds none of them."""
    path = Path(path)
    try:
        with AnyReader([path], default_typestore=type_store()) as reader:
            chosen = _choose(reader, path.name)
            logged = list(_samples(reader, chosen, settings or AdapterSettings()))
            sources = _sources(reader, chosen)
    except InputError:
        raise
    except Exception as error:  # parsers of a damaged file raise all kinds of exceptions
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"bag {path.name}: cannot be read: {words}; record it again, or repair it") from error
    return _converted(logged, chosen, sources, f"bag {path.name}")


def _choose(reader: AnyReader, name: str) -> _Chosen:
    topics = {c.topic: c.msgtype for c in reader.connections}
    autopilot = autopilot_of(topics)
    if autopilot is None:
        present = ", ".join(f"{topic} ({kind})" for topic, kind in topics.items())
        raise InputError(
            f"bag {name}: neither imu/data, air_data and actuators, nor an autopilot's topics (MAVROS, PX4, "
            f"ROSflight); it has {present or 'no messages'}"
        )
    adapter = ADAPTERS[autopilot]
    by_topic: dict[str, list[Connection]] = {}
    for connection in reader.connections:
        ours = _ours(connection.topic, adapter)
        if ours is not None:
            by_topic.setdefault(ours, []).append(connection)
    received: dict[int, tuple[str, ...]] = {}
    for ours, connections in by_topic.items():
        best = max(connections, key=lambda c: c.msgcount)
        received[best.id] = (*received.get(best.id, ()), ours)
    if autopilot == "mavros" and MAVROS_IMU not in by_topic and MAVROS_ATTITUDE in by_topic:
        (only,) = [key for key, names in received.items() if MAVROS_ATTITUDE in names]
        received[only] = (MAVROS_ATTITUDE, MAVROS_IMU)
    return _Chosen(autopilot, received)


def _sources(reader: AnyReader, chosen: _Chosen) -> dict[str, str]:
    """The recorded topic behind each topic of the adapter."""
    return {ours: c.topic for c in reader.connections for ours in chosen.connections.get(c.id, ())}


def _samples(reader: AnyReader, chosen: _Chosen, settings: AdapterSettings) -> Iterator[tuple[str, LoggedSample]]:
    kind = ADAPTERS[chosen.autopilot]
    raw = " ".join(f"{output}={output}:0:1" for output in kind.outputs)
    adapter = kind(AdapterSettings(raw, settings.air_temperature, settings.air_data_delay))
    connections = [c for c in reader.connections if c.id in chosen.connections]
    for order, (connection, log_ns, data) in enumerate(reader.messages(connections)):
        message: Any = reader.deserialize(data, connection.msgtype)
        for ours in chosen.connections[connection.id]:
            sample = adapter.hear(ours, message)
            if sample is not None:
                yield ours, LoggedSample(order, log_ns, sample)


def _converted(
    logged: Sequence[tuple[str, LoggedSample]], chosen: _Chosen, sources: Mapping[str, str], name: str
) -> AutopilotLog:
    imu = [(one.sample, one.sample.attitude) for _, one in logged if isinstance(one.sample, ImuSample)]
    air = [one.sample for _, one in logged if isinstance(one.sample, AirSample)]
    joints = [one.sample for _, one in logged if isinstance(one.sample, JointSample)]
    kinds = {type(one.sample): sources[ours] for ours, one in logged}
    said = {kind: _short(kinds[kind]) if kind in kinds else word for kind, word in _WORDS.items()}
    motion = _signal(said[ImuSample], [s.stamp_ns for s, _ in imu], [(*s.force, *s.rates) for s, _ in imu], 6)
    turned = _signal("attitude", [s.stamp_ns for s, _ in imu], [a or (np.nan,) * 4 for _, a in imu], 4)
    stamps = [s.stamp_ns for s in air]
    airspeed = _signal(said[AirSample], stamps, [(s.true_airspeed,) for s in air], 1)
    density = _signal("pressure", stamps, [(s.air_density,) for s in air], 1)
    flow = np.array([(s.angle_of_attack, s.sideslip) for s in air]).reshape(-1, 2)
    names = joints[0].names if joints else ()
    outputs = _signal(said[JointSample], [s.stamp_ns for s in joints], [s.positions for s in joints], len(names))
    remedy = _RATE[chosen.autopilot]
    return AutopilotLog(
        name=name,
        autopilot={"mavros": "MAVROS", "px4": "PX4", "rosflight": "ROSflight"}[chosen.autopilot],
        imu=motion,
        attitude=turned,
        airspeed=airspeed,
        density=density.selected(np.isfinite(density.values[:, 0])),
        controls=LoggedCommands((), absent(said[JointSample], 0)),
        outputs=LoggedCommands(tuple(names), outputs),
        vanes=Signal("vanes", airspeed.stamp_ns, flow) if np.isfinite(flow).any() else None,
        remarks=("a recording of topics holds no parameters of the outputs",),
        remedies={IMU: remedy, AIRSPEED: remedy, CONTROLS: remedy},
    )


#: What each kind of sample is called where its topic is not recorded.
_WORDS = {ImuSample: "IMU", AirSample: "airspeed", JointSample: "outputs"}


def _short(topic: str) -> str:
    """A topic without the prefix that all of an autopilot's topics have."""
    return re.sub(r"^.*?/(mavros|fmu/out)/|^/", "", topic)


def _signal(source: str, stamps: Sequence[int], rows: Sequence[Sequence[float]], width: int) -> Signal:
    values: Array = np.array(rows, float).reshape(-1, width) if rows else np.empty((0, width))
    return Signal(source, np.array(stamps, np.int64), values)
