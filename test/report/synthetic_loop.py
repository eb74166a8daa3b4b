"""A made-up closed loop: a minute in which the elevator loses its effectiveness at 30 s."""

import math

import numpy as np

from sysid_node.report.results.closed_loop import ClosedLoopFlight, Event

TIME = np.arange(0.0, 60.0, 0.01).tolist()
EVENTS = (
    Event(3.2, "exciter", "begun"),
    Event(5.0, "adaptive_controller", "pitch: adapted; lateral: adapted"),
    Event(8.0, "exciter", "known after 4.8 s"),
    Event(21.0, "fault_monitor", "nothing has failed"),
    Event(30.0, "loop", "control_effectiveness_loss:elevator=0.6"),
    Event(31.5, "fault_monitor", "elevator: loss of effectiveness"),
    Event(31.5, "exciter", "begun again: Cm_de no longer known"),
    Event(33.5, "exciter", "estimates begun anew"),
)


def episode(events: tuple[Event, ...] = EVENTS, failure: str = EVENTS[4].text) -> ClosedLoopFlight:
    """Pitch is off by 0.01 rad until 30 s and by 0.02 rad after; a tenth of the rows is not measured."""
    off = [math.nan if i % 10 == 0 else 0.01 if t < 30.0 else 0.02 for i, t in enumerate(TIME)]
    errors = {"pitch": off, "roll": [0.0] * len(TIME), "sideslip": [0.0] * len(TIME)}
    commanded = {"pitch": [0.08] * len(TIME), "roll": [0.2] * len(TIME)}
    return ClosedLoopFlight("cdrw", failure, 30.0, True, TIME, errors, commanded, {}, events, {"imu/data": 3})
