"""Which topics of a recording are an autopilot's, told by their names under any namespace, and by their types."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from rosbags.interfaces import Connection

from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import Adapter
from sysid_node.flight.autopilots.known import ADAPTERS

#: The part of an adapter's names that stands for the vehicle, where a launch file may put another namespace.
_OWN = re.compile(r"^/mavros(?=/)")

#: Fewer topics than this are no recording of an autopilot.
_FEWEST = 2


class RecordedTopics(NamedTuple):
    """The connections of a recording that an adapter hears, with the adapter's own names of their topics.

    ``namespace`` is what stands before these; ``sources`` are the recorded topics by the adapter's names.
    """

    namespace: str
    connections: Mapping[int, tuple[str, ...]]
    sources: Mapping[str, str]
    remarks: tuple[str, ...]


def autopilot_of(topics: Mapping[str, str]) -> str | None:
    """The autopilot whose topics (name -> type) are recorded, at least two of them; None where there is none."""
    counts = {name: max(map(len, _vehicles(topics, kind).values()), default=0) for name, kind in ADAPTERS.items()}
    best = max(counts, key=lambda name: counts[name])
    return best if counts[best] >= _FEWEST else None


def recorded_topics(connections: Sequence[Connection], adapter: type[Adapter], bag: str) -> RecordedTopics:
    """The topics of the vehicle that an adapter hears in the ``bag``, empty where there are none.

    Of two topics that serve for the same, the one with more messages is taken, and all of its connections. Of several
    vehicles the one with most topics is taken. Raises InputError where several have as many.
    """
    vehicles = _vehicles({c.topic: c.msgtype for c in connections}, adapter)
    most = max(map(len, vehicles.values()), default=0)
    namespaces = [name for name, found in vehicles.items() if len(found) == most]
    if len(namespaces) > 1:
        keep = sorted(topic for topics in vehicles[namespaces[0]].values() for topic in topics)
        raise InputError(
            f"{bag}: topics of several vehicles in it ({', '.join(namespaces)}); keep those of one, e.g. "
            f"rosbags-convert --src BAG --dst NEW --include-topic {' '.join(keep)}"
        )
    namespace = namespaces[0] if namespaces else ""
    counts: dict[str, int] = {}
    for connection in connections:
        counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
    sources = {ours: max(topics, key=counts.__getitem__) for ours, topics in vehicles.get(namespace, {}).items()}
    sources |= {
        ours: sources[other] for ours, other in adapter.stand_ins.items() if other in sources and ours not in sources
    }
    heard = {c.id: tuple(ours for ours, topic in sources.items() if topic == c.topic) for c in connections}
    others = [name for name, found in vehicles.items() if name != namespace and len(found) >= _FEWEST]
    remark = f"topics of {', '.join(others)} are left out: {namespace or '/'} has more of what is needed"
    return RecordedTopics(
        namespace, {one: names for one, names in heard.items() if names}, sources, (remark,) if others else ()
    )


def _vehicles(topics: Mapping[str, str], adapter: type[Adapter]) -> dict[str, dict[str, list[str]]]:
    """By namespace, the recorded topics (name -> type) behind each topic of an adapter."""
    found: dict[str, dict[str, list[str]]] = {}
    for topic in topics:
        place = _place(topic, adapter)
        if place is not None:
            found.setdefault(place[0], {}).setdefault(place[1], []).append(topic)
    return {
        namespace: group
        for namespace, group in found.items()
        if _is_own(namespace, adapter) or _has_type(adapter, (topics[t] for names in group.values() for t in names))
    }


def _place(topic: str, adapter: type[Adapter]) -> tuple[str, str] | None:
    """The namespace of a recorded topic and the adapter's name of it: without the version that PX4 appends."""
    bare = re.sub(r"_v\d+$", "", topic)
    for ours in adapter.topics:
        for name in (ours, *adapter.aliases.get(ours, ())):
            ending = _OWN.sub("", name)
            if bare.endswith(ending):
                return bare.removesuffix(ending), ours
    return None


def _is_own(namespace: str, adapter: type[Adapter]) -> bool:
    """Whether the names alone are the adapter's: PX4's in any namespace, MAVROS's in its own, ROSflight's in none."""
    names = [name for name in adapter.topics if _OWN.match(name) or name.startswith("/fmu/")]
    if not names:
        return not namespace
    return namespace.endswith("/mavros") or names[0].startswith("/fmu/")


def _has_type(adapter: type[Adapter], types: Iterable[str]) -> bool:
    return any(kind.startswith(f"{adapter.package}/") for kind in types)
