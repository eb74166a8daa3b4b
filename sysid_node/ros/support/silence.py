"""What the graph of ROS tells of a node's topics: why one is silent, and which have several publishers.

A topic is silent where nobody publishes it, or not as this node listens to it.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSCompatibility, qos_check_compatible

from sysid_node.flight.topics import EXCITATION

UNHEARD = 2.0  # s without a message, after which a node says so in its log
SHOWN = 3  # topics of the right type that are named at most


def why_silent(node: Node, subscription: Any) -> str:
    """Why no message comes to a ``subscription`` of the node, in words with a colon before; empty where it is unknown.

    A publisher that has the right type and quality of service, and sends nothing, is no reason that is known.
    """
    topic, wanted = subscription.topic_name, _type_name(subscription.msg_type)
    publishers = node.get_publishers_info_by_topic(topic)
    if not publishers:
        return f": nobody publishes it{_elsewhere(node, topic, wanted)}"
    right = [one for one in publishers if one.topic_type == wanted]
    if not right:
        types = ", ".join(sorted({one.topic_type for one in publishers}))
        return f": it is published as {types}, not as {wanted}"
    checks = [qos_check_compatible(one.qos_profile, subscription.qos_profile) for one in right]
    if all(compatible == QoSCompatibility.ERROR for compatible, _ in checks):
        return ": its publisher's quality of service is not what this node asks for (see qos_overrides)"
    return ""


def several_publishers(node: Node, subscriptions: Iterable[Any]) -> dict[str, str]:
    """By topic, that it has several publishers, of the topics of the ``subscriptions`` that have."""
    counts = {one.topic_name: node.count_publishers(one.topic_name) for one in subscriptions}
    words = "publishers, taken as one: stop all but one, or remap their topics"
    return {topic: f"{count} {words}" for topic, count in counts.items() if count > 1}


def namesakes(node: Node, publishers: Iterable[Any]) -> dict[str, str]:
    """By topic, that other nodes publish it as well, of the topics of this node's own ``publishers``."""
    counts = {one.topic_name: node.count_publishers(one.topic_name) for one in publishers}
    words = "nodes publish it, and estimates of all come mixed: stop all but one, or give each a namespace"
    return {topic: f"{count} {words}" for topic, count in counts.items() if count > 1}


def joined(first: Mapping[str, str], second: Mapping[str, str]) -> dict[str, str]:
    """By topic, what either says of it, or both."""
    both = {topic: f"{first[topic]}; {text}" if topic in first else text for topic, text in second.items()}
    return {**first, **both}


class ClockWatch:
    """Whether /clock has come to a node that takes its time from there."""

    def __init__(self, node: Node) -> None:
        self._node, self._since = node, time.monotonic()

    def missing(self) -> dict[str, str]:
        """The topic /clock with what is wrong with it, where none has come for ``UNHEARD`` s; else nothing."""
        simulated = self._node.get_parameter("use_sim_time").value
        waits = simulated and self._node.get_clock().now().nanoseconds == 0
        late = time.monotonic() - self._since > UNHEARD
        return {"/clock": "no message yet, and use_sim_time is true"} if waits and late else {}


def _elsewhere(node: Node, topic: str, wanted: str) -> str:
    """The topics with messages of the type that is wanted, in words; empty where there are none."""
    names = [name for name, types in node.get_topic_names_and_types() if wanted in types and name != topic]
    found = sorted(name for name in names if node.count_publishers(name) and not _for_another(node, name))
    more = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
    return f", but {wanted} is published on {', '.join(found[:SHOWN])}{more}: remap it?" if found else ""


def _for_another(node: Node, topic: str) -> bool:
    """Whether a topic is none that this node might hear in place of its own.

    It is the input of another aircraft's node of the same name, or what a node publishes under its own name, or the
    excitation.
    """
    heard = node.get_subscriptions_info_by_topic(topic)
    if topic.endswith(f"/{EXCITATION}") or any(one.node_name == node.get_name() for one in heard):
        return True
    publishers = node.get_publishers_info_by_topic(topic)
    return all(topic.startswith(f"{one.node_namespace.rstrip('/')}/{one.node_name}/") for one in publishers)


def _type_name(kind: Any) -> str:
    return f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
