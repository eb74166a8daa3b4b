"""Faults as messages: what ``fault_monitor`` publishes on ``~/faults``, made without ROS."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rosbags.typesys.store import Typestore

from sysid_node.faults.recorded_flight import Said
from sysid_node.faults.types import Fault
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.writer import header

FAULTS, FAULTS_TYPE = "/fault_monitor/faults", "diagnostic_msgs/msg/DiagnosticArray"
ERROR = 2  # diagnostic_msgs/DiagnosticStatus


def fault_messages(said: Sequence[Said], aircraft: str) -> Iterator[tuple[int, bytes]]:
    """Each with the time (ns) at which it is logged: the header stamp of the sample that it includes last."""
    store = type_store()
    for moment in said:
        head = header(store, "")
        head.stamp.sec, head.stamp.nanosec = divmod(moment.stamp_ns, 1_000_000_000)
        statuses = [_status(store, fault, moment.time, aircraft) for fault in moment.faults]
        message = store.types[FAULTS_TYPE](head, statuses)
        yield moment.stamp_ns, bytes(store.serialize_cdr(message, FAULTS_TYPE))


def _status(store: Typestore, fault: Fault, now: float, aircraft: str) -> Any:
    pair = store.types["diagnostic_msgs/msg/KeyValue"]
    return store.types["diagnostic_msgs/msg/DiagnosticStatus"](
        level=ERROR,
        name=f"fault_monitor: {fault.part}",
        message=fault.text,
        hardware_id=aircraft,
        values=[pair(key=key, value=value) for key, value in fault.values(now).items()],
    )
