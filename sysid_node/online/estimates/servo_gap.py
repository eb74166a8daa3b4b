"""How late each control follows what is recorded of it, beside what the aircraft file says."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.servos import servos_of
from sysid_node.online.systematic.servo_model import of_servo
from sysid_node.online.types import DerivativeEstimate

#: Standard errors by which a control acts later than recorded where it surely does.
SURELY = 3.0


class ServoGap(NamedTuple):
    """One control's servo: lag and delay together, s."""

    control: str
    time: float  # as estimated
    standard_error: float
    in_file: float  # by the aircraft file; NaN where it says nothing


def servo_times_in_file(aircraft: Aircraft) -> dict[str, float]:
    """By control, how late (s) the aircraft file says that it follows its command; only those of which it says so."""
    effects = (aircraft.effects.get(effect, {}) for effect in ("actuator_lag", "command_delay"))
    stated = {name for effect in effects for name in effect}
    servos = zip(aircraft.controls, servos_of(aircraft)[1:], strict=True)
    return {name: of_servo(servo)[0] for name, servo in servos if name in stated}


def servo_gaps(in_file: Mapping[str, float], servos: Mapping[str, DerivativeEstimate]) -> list[ServoGap]:
    """The servos whose time the flight shows, beside the times (s) of the file as ``servo_times_in_file`` has them."""
    return [
        ServoGap(name, d.value, d.standard_error, in_file.get(name, math.nan)) for name, d in servos.items() if d.valid
    ]


def surely_late(servos: Mapping[str, DerivativeEstimate]) -> list[str]:
    """The controls that surely act later than what is recorded of them, as they do after commands."""
    return [name for name, d in servos.items() if d.valid and d.value > SURELY * d.standard_error]
