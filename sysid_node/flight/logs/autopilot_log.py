"""``AutopilotLog``: what a log of an autopilot holds, before a part of it is chosen and turned into streams."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sysid_node.flight.logs.flown import Mask, Spans
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps

#: The roles of the signals that a flight needs.
IMU, AIRSPEED, CONTROLS = "imu", "airspeed", "controls"


@dataclass(frozen=True)
class Signal:
    """The N samples of one message type, in the log's order; ``source`` is the message's name in the log."""

    source: str
    stamp_ns: Stamps  # (N,)
    values: Array  # (N, K), NaN = not measured

    def __len__(self) -> int:
        return int(self.stamp_ns.size)

    def selected(self, keep: Mask) -> Signal:
        """The samples for which ``keep`` (N,) is true."""
        return Signal(self.source, self.stamp_ns[keep], self.values[keep])


def absent(source: str, width: int) -> Signal:
    """A signal without samples."""
    return Signal(source, np.empty(0, np.int64), np.empty((0, width)))


@dataclass(frozen=True)
class LoggedCommands:
    """Commands to the controls, or the raw outputs from which the aircraft file's ``outputs`` makes joints."""

    names: tuple[str, ...]  # one a column of the signal
    signal: Signal


@dataclass(frozen=True)
class AutopilotLog:
    """The signals of a log. Axes are forward-right-down, units SI and rad."""

    name: str
    autopilot: str  # its name and version
    imu: Signal  # (N, 6) specific force, rates
    attitude: Signal  # (N, 4) w x y z, which rotates body axes to north-east-down
    airspeed: Signal  # (N, 1) true airspeed
    density: Signal  # (N, 1)
    controls: LoggedCommands  # fractions of the full command, as in ``streams.COMMAND_FRACTIONS``
    outputs: LoggedCommands  # in the unit of the log: us of pulse, or -1..1
    vanes: Signal | None = None  # (N, 2) angle of attack, sideslip; None: no vane was logged
    flown: Spans | None = None  # in the air as a fixed wing; None: the log does not say
    remarks: tuple[str, ...] = ()
    remedies: Mapping[str, str] = field(default_factory=dict)  # role -> the setting that raises its rate
    lacks: Mapping[str, str] = field(default_factory=dict)  # role -> why it has no usable samples, and what to do
    banks: tuple[LoggedCommands, ...] = ()  # of which the outputs are made, each at its own times
    unmapped: str = ""  # why the log does not tell which output moves which surface


def joined(banks: Sequence[LoggedCommands], base: Signal) -> LoggedCommands:
    """All outputs of some banks at the times of one of them; of the others, their last sample before."""
    names: list[str] = []
    columns: list[Array] = []
    for bank in banks:
        place = np.searchsorted(bank.signal.stamp_ns, base.stamp_ns, side="right") - 1
        names += bank.names
        columns += list(bank.signal.values[np.clip(place, 0, len(bank.signal) - 1)].T)
    values = np.column_stack(columns) if columns else np.empty((0, 0))
    return LoggedCommands(tuple(names), Signal(base.source, base.stamp_ns, values))


def with_outputs_of(log: AutopilotLog, outputs: str) -> AutopilotLog:
    """The log, whose outputs are at the times of the bank that moves most of the joints.

    ``outputs``: which output moves which joint, as in the aircraft file.
    """
    moved = [word.partition("=")[2].partition(":")[0] for word in outputs.split()]
    counts = [sum(name in bank.names for name in moved) for bank in log.banks]
    if max(counts, default=0) == 0:
        return log
    base = log.banks[counts.index(max(counts))].signal
    return replace(log, outputs=joined(log.banks, base))
