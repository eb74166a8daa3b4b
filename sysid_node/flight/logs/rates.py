"""The rates that a flight's topics need, and the words that say which one is too low."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, AutopilotLog
from sysid_node.flight.logs.autopilot_log import IMU as IMU_ROLE
from sysid_node.flight.logs.flown import within
from sysid_node.flight.logs.steps import MOSTLY, share_in_steps
from sysid_node.flight.record import Array
from sysid_node.flight.streams import Stamps, Streams
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU

#: The lowest rates (Hz) at which estimates hold (docs/results/log_rates.md); of commands that move smoothly.
NEEDED = {IMU: 20.0, AIR_DATA: 2.0, ACTUATORS: 20.0}

#: The lowest rate (Hz) of commands that move in steps: between samples the time of a step is not known.
NEEDED_FOR_STEPS = 50.0


#: Throttle and flaps stand still or step in every flight, and are no input of a manoeuvre.
_NOT_STEPPED = {"throttle", "flap"}


class SampleRate(NamedTuple):
    """The rate (Hz) of a topic: one over the median step of its stamps."""

    source: str
    rate: float
    needed: float
    remedy: str

    @property
    def fault(self) -> str:
        """What is too slow, or an empty text."""
        if self.rate >= 0.93 * self.needed:  # stamps of a logger scatter
            return ""
        why = " for commands in steps" if self.needed == NEEDED_FOR_STEPS else ""
        return f"{self.source} comes at {rate_text(self.rate)} Hz; {self.needed:g} Hz are needed{why}"


def rate_of(stamps: Stamps) -> float:
    """The rate (Hz) at which samples come: one over the median step; 0 for fewer than two."""
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    return 1e9 / float(np.median(steps)) if steps.size else 0.0


def rate_text(rate: float) -> str:
    """A rate as a text: one decimal below 10 Hz, unless it is a whole number."""
    return f"{round(rate, 1):g}" if rate < 10.0 else f"{rate:.0f}"


def rates_of_log(log: AutopilotLog, *, raw_outputs: bool = False) -> dict[str, SampleRate]:
    """The rates of the IMU, the airspeed and the controls in the part that was flown, by topic."""
    use_outputs = raw_outputs or not log.controls.names
    signals = {
        IMU: (log.imu, IMU_ROLE),
        AIR_DATA: (log.airspeed, AIRSPEED),
        ACTUATORS: ((log.outputs if use_outputs else log.controls).signal, CONTROLS),
    }
    found = {}
    for topic, (signal, role) in signals.items():
        rate = rate_of(signal.stamp_ns[within(log.flown or None, signal.stamp_ns)])
        found[topic] = SampleRate(signal.source, rate, NEEDED[topic], log.remedies.get(role, ""))
    if not use_outputs:
        commands = log.controls.signal.selected(within(log.flown or None, log.controls.signal.stamp_ns))
        found[ACTUATORS] = _with_steps(found[ACTUATORS], log.controls.names, commands.values)
    return found


def _with_steps(found: SampleRate, names: Sequence[str], commands: Array) -> SampleRate:
    """The rate with what is needed where the surfaces' commands (N, C) move in steps."""
    surfaces = [i for i, name in enumerate(names) if name not in _NOT_STEPPED]
    stepped = share_in_steps(commands[:, surfaces]) >= MOSTLY
    return found._replace(needed=NEEDED_FOR_STEPS) if stepped else found


def rates_of_streams(streams: Streams) -> dict[str, SampleRate]:
    """The rates of the topics of a flight."""
    found = {
        topic: SampleRate(stream.source or topic, rate_of(stream.arrival.stamp_ns), NEEDED[topic], stream.remedy)
        for topic, stream in streams.by_topic.items()
    }
    joints = streams.actuators
    if joints.content:
        found[ACTUATORS] = _with_steps(found[ACTUATORS], joints.names, joints.positions)
    return found
