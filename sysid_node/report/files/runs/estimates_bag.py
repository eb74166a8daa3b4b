"""Estimates and faults as a bag: ``ros2 bag play``, PlotJuggler and Foxglove show them as if they were live."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sysid_node.faults.recorded_flight import FaultReport
from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.bag.writer import add_topic, new_bag
from sysid_node.flight.streams import Stamps
from sysid_node.flight.topics import DERIVATIVES, DERIVATIVES_TYPE
from sysid_node.online.estimates.serialisation import EstimatesSerialiser
from sysid_node.online.types import Estimates
from sysid_node.report.files.runs.fault_messages import FAULTS, FAULTS_TYPE, fault_messages

_AT_ONCE = 1024  # estimates that are serialised together


def write_estimates(
    path: Path,
    history: Sequence[Estimates],
    stamps_ns: Stamps,
    *,
    aircraft: str,
    method: str,
    frame_id: str,
    faults: Sequence[FaultReport] = (),
) -> None:
    """DerivativeEstimates on /identifier/derivatives, each stamped and logged at the sample that it includes last.

    ``stamps_ns`` (K,) of ``history`` (K,). ``faults`` are put on /fault_monitor/faults alike. Raises InputError where
    the bag exists or cannot be written.
    """
    serialiser = EstimatesSerialiser(definitions_of(type_store()), aircraft, method)
    with new_bag(path) as writer:
        topic = add_topic(writer, DERIVATIVES, DERIVATIVES_TYPE)
        for first in range(0, len(history), _AT_ONCE):
            some, stamps = history[first : first + _AT_ONCE], stamps_ns[first : first + _AT_ONCE]
            for stamp, data in zip(stamps.tolist(), serialiser.many(some, stamps, frame_id), strict=True):
                writer.write(topic, stamp, data)
        if faults:
            topic = add_topic(writer, FAULTS, FAULTS_TYPE)
            for stamp, data in fault_messages(faults, aircraft):
                writer.write(topic, stamp, data)
