"""Reads ROS recordings, ROS 1 or 2, of an autopilot's own topics: MAVROS 1 and 2, PX4 and ROSflight.

The messages are converted by the functions of the live adapter (``flight.autopilots``).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import Adapter, AdapterSettings, AirSample, ImuSample, JointSample
from sysid_node.flight.autopilots.five_topics import FiveTopics
from sysid_node.flight.autopilots.known import ADAPTERS
from sysid_node.flight.autopilots.recorded import LoggedSample, heard_samples
from sysid_node.flight.autopilots.recorded_topics import RecordedTopics, autopilot_of, recorded_topics
from sysid_node.flight.bag.recordings import open_recording
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, IMU, AutopilotLog, LoggedCommands, Signal, absent
from sysid_node.flight.record import Array

_RATE = {
    "mavros": "request the message at a higher rate (service /mavros/set_message_interval)",
    "px4": "add it to dds_topics.yaml without rate_limit",
    "rosflight": "raise the firmware's parameter STRM_*",
}


_NO_PARAMETERS = "a recording of topics holds no parameters of the outputs"


def read_autopilot_bag(path: str | Path, settings: AdapterSettings | None = None) -> AutopilotLog:
    """The signals of a bag of an autopilot's topics. Raises InputError where it is damaged, or holds none of them."""
    path, settings = Path(path), settings or AdapterSettings()
    with open_recording(path) as reader:
        topics = {c.topic: c.msgtype for c in reader.connections}
        autopilot = autopilot_of(topics)
        if autopilot is None:
            present = ", ".join(f"{topic} ({kind})" for topic, kind in topics.items())
            raise InputError(
                f"bag {path.name}: neither imu/data, air_data and actuators, nor an autopilot's topics (MAVROS, PX4, "
                f"ROSflight); it has {present or 'no messages'}"
            )
        kind = ADAPTERS[autopilot]
        chosen = recorded_topics(reader.connections, kind, f"bag {path.name}")
        raw = " ".join(f"{output}={output}:0:1" for output in kind.outputs)
        adapter = kind(AdapterSettings(raw, settings.air_temperature, settings.air_data_delay))
        logged = list(heard_samples(reader, chosen, adapter, path.name))
    return _converted(logged, autopilot, chosen, f"bag {path.name}")


def _converted(
    logged: Sequence[tuple[str, LoggedSample]], autopilot: str, chosen: RecordedTopics, name: str
) -> AutopilotLog:
    imu = [(one.sample, one.sample.attitude) for _, one in logged if isinstance(one.sample, ImuSample)]
    air = [one.sample for _, one in logged if isinstance(one.sample, AirSample)]
    joints = [one.sample for _, one in logged if isinstance(one.sample, JointSample)]
    kinds = {type(one.sample): chosen.sources[ours].removeprefix(chosen.namespace) for ours, one in logged}
    said = {kind: _short(kinds[kind]) if kind in kinds else word for kind, word in _WORDS.items()}
    motion = _signal(said[ImuSample], [s.stamp_ns for s, _ in imu], [(*s.force, *s.rates) for s, _ in imu], 6)
    turned = _signal("attitude", [s.stamp_ns for s, _ in imu], [a or (np.nan,) * 4 for _, a in imu], 4)
    stamps = [s.stamp_ns for s in air]
    airspeed = _signal(said[AirSample], stamps, [(s.true_airspeed,) for s in air], 1)
    density = _signal("pressure", stamps, [(s.air_density,) for s in air], 1)
    flow = np.array([(s.angle_of_attack, s.sideslip) for s in air]).reshape(-1, 2)
    names = joints[0].names if joints else ()
    outputs = _signal(said[JointSample], [s.stamp_ns for s in joints], [s.positions for s in joints], len(names))
    remedy = _RATE[autopilot]
    return AutopilotLog(
        name=name,
        autopilot={"mavros": "MAVROS", "px4": "PX4", "rosflight": "ROSflight"}[autopilot],
        imu=motion,
        attitude=turned,
        airspeed=airspeed,
        density=density.selected(np.isfinite(density.values[:, 0])),
        controls=LoggedCommands((), absent(said[JointSample], 0)),
        outputs=LoggedCommands(tuple(names), outputs),
        vanes=Signal("vanes", airspeed.stamp_ns, flow) if np.isfinite(flow).any() else None,
        remarks=(_NO_PARAMETERS, *chosen.remarks),
        remedies={IMU: remedy, AIRSPEED: remedy, CONTROLS: remedy},
        lacks=_lacks(ADAPTERS[autopilot], chosen),
        unmapped=_NO_PARAMETERS,
    )


def _lacks(kind: type[Adapter], chosen: RecordedTopics) -> dict[str, str]:
    """What was not recorded, by role: also the static pressure, without which there is no density, nor an airspeed."""
    names = {ours: chosen.namespace + ours.removeprefix("/mavros") for ours in kind.topics}
    lacking = {
        role: f"no {names[ours]} in it; record it too"
        for role, ours in zip((IMU, AIRSPEED, CONTROLS), kind.essential, strict=True)
        if ours not in chosen.sources
    }
    if issubclass(kind, FiveTopics) and kind.parts[2] not in chosen.sources and AIRSPEED not in lacking:
        pressure, airspeed = names[kind.parts[2]], chosen.sources[kind.parts[3]]
        lacking[AIRSPEED] = f"no {pressure} in it, which makes a true airspeed of {airspeed}; record it too"
    return lacking


#: What each kind of sample is called where its topic is not recorded.
_WORDS = {ImuSample: "IMU", AirSample: "airspeed", JointSample: "outputs"}


def _short(topic: str) -> str:
    """A topic, without its namespace already, without the prefix that all of an autopilot's topics have."""
    return re.sub(r"^/fmu/out/|^/", "", topic)


def _signal(source: str, stamps: Sequence[int], rows: Sequence[Sequence[float]], width: int) -> Signal:
    values: Array = np.array(rows, float).reshape(-1, width) if rows else np.empty((0, width))
    return Signal(source, np.array(stamps, np.int64), values)
