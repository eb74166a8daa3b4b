"""Faults as messages: what ``fault_monitor`` publishes on ``~/faults``, made without ROS."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sysid_node.faults.recorded_flight import FaultReport
from sysid_node.faults.types import Fault
from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.cdr.template import Templates, Values

FAULTS, FAULTS_TYPE = "/fault_monitor/faults", "diagnostic_msgs/msg/DiagnosticArray"
ERROR = 2  # diagnostic_msgs/DiagnosticStatus


def fault_messages(reports: Sequence[FaultReport], aircraft: str) -> Iterator[tuple[int, bytes]]:
    """Each with the time (ns) at which it is logged: the header stamp of the sample that it includes last."""
    templates = Templates(definitions_of(type_store()))
    for report in reports:
        header = (divmod(report.stamp_ns, 1_000_000_000), "")
        statuses = tuple(_status(fault, report.time, aircraft) for fault in report.faults)
        yield report.stamp_ns, templates.template(FAULTS_TYPE, (header, statuses)).text


def _status(fault: Fault, now: float, aircraft: str) -> Values:
    """A diagnostic_msgs/DiagnosticStatus: level, name, message, hardware_id, values."""
    return ERROR, f"fault_monitor: {fault.part}", fault.text, aircraft, tuple(fault.values(now).items())
