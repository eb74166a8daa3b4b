"""The rates that a flight's topics need, and the words that say which one is too low."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, AutopilotLog
from sysid_node.flight.logs.autopilot_log import IMU as IMU_ROLE
from sysid_node.flight.logs.flown import within
from sysid_node.flight.streams import Stamps, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

#: The lowest rates (Hz) at which estimates hold (docs/results/log_rates.md), in the order of the topics.
NEEDED = {IMU: 20.0, AIR_DATA: 2.0, ACTUATORS: 20.0}


class SampleRate(NamedTuple):
    """The rate (Hz) of a topic: one over the median step of its stamps."""

    source: str
    rate: float
    needed: float
    remedy: str

    @property
    def fault(self) -> str:
        """What is too slow and what to do, or an empty text."""
        if self.rate >= 0.93 * self.needed:  # stamps of a logger scatter
            return ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{self.source} comes at {said_rate(self.rate)} Hz; {self.needed:g} Hz are needed{remedy}"


def rate_of(stamps: Stamps) -> float:
    """The rate (Hz) at which samples come: one over the median step; 0 for fewer than two."""
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    return 1e9 / float(np.median(steps)) if steps.size else 0.0


def said_rate(rate: float) -> str:
    """A rate as a text: one decimal below 10 Hz, unless it is a whole number."""
    return f"{round(rate, 1):g}" if rate < 10.0 else f"{rate:.0f}"


def rates_of_log(log: AutopilotLog, *, raw_outputs: bool = False) -> dict[str, SampleRate]:
    """The rates of the IMU, the airspeed and the controls in the part that was flown, by the signals' roles."""
    use_outputs = raw_outputs or not log.controls.names
    signals = {
        IMU_ROLE: (log.imu, IMU),
        AIRSPEED: (log.airspeed, AIR_DATA),
        CONTROLS: ((log.outputs if use_outputs else log.controls).signal, ACTUATORS),
    }
    return {
        role: SampleRate(
            signal.source,
            rate_of(signal.stamp_ns[within(log.flown, signal.stamp_ns)]),
            NEEDED[topic],
            log.remedies.get(role, ""),
        )
        for role, (signal, topic) in signals.items()
    }


def require_rates_of_log(log: AutopilotLog, *, raw_outputs: bool = False) -> None:
    """Raise InputError as ``require_rates``, for the signals that the log holds."""
    for found in rates_of_log(log, raw_outputs=raw_outputs).values():
        if found.rate and found.fault:
            raise InputError(f"{log.name}: {found.fault}")


def slow_topics(streams: Streams) -> tuple[str, ...]:
    """For each topic that comes at too low a rate: the rate, the one needed, and the autopilot's setting."""
    every = streams.by_topic.items()
    rates = [SampleRate(s.source or topic, rate_of(s.arrival.stamp_ns), NEEDED[topic], s.remedy) for topic, s in every]
    return tuple(found.fault for found in rates if found.fault)


def require_rates(streams: Streams) -> None:
    """Raise InputError, which names the topic and the autopilot's setting, where one comes at too low a rate."""
    slow = slow_topics(streams)
    if slow:
        raise InputError(f"{streams.name}: {slow[0]}")
