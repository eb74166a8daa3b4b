"""Why a flight is not taken. The commands refuse it with these reasons, and ``sysid check`` tells them beforehand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from sysid_node.errors import InputError
from sysid_node.flight.align import STEP_BACK_NS
from sysid_node.flight.logs.autopilot_log import AIRSPEED, CONTROLS, IMU, AutopilotLog
from sysid_node.flight.logs.flown import within
from sysid_node.flight.logs.rates import SampleRate, rates_of_log, rates_of_streams
from sysid_node.flight.streams import Stamps, Streams

#: Below this airspeed (m/s) in every sample, nothing was measured: no fixed wing flies so slowly.
_SLOWEST = 2.0


class Refusal(NamedTuple):
    """Why a flight is not taken, a clause each, and the settings that would change it; empty where it is taken."""

    reasons: tuple[str, ...] = ()
    remedies: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """Both in one line."""
        return "; ".join((*self.reasons, *self.remedies))


def require(name: str, refusal: Refusal) -> None:
    """Raise InputError, which names the flight, where there is a reason to refuse it."""
    if refusal.reasons:
        raise InputError(f"{name}: {refusal.text}")


def refusal_of_log(log: AutopilotLog, *, raw_outputs: bool) -> Refusal:
    """Signals of an autopilot's log that are missing or come too slowly.

    ``raw_outputs``: whether the aircraft file's ``outputs`` stand for the log's parameters.
    """
    useless = _useless(log, raw_outputs=raw_outputs)
    if useless:  # nothing else can be said of it
        return Refusal(useless)
    slow = _slow(rates_of_log(log, raw_outputs=raw_outputs).values())
    airspeed, controls = missing_airspeed(log), missing_controls(log, raw_outputs=raw_outputs)
    return Refusal(tuple(reason for reason in (airspeed, *slow.reasons, controls) if reason), slow.remedies)


def refusal_of_streams(streams: Streams) -> Refusal:
    """Topics of a converted log that come too slowly. Other bags, and tables, are taken at any rate."""
    return _slow(rates_of_streams(streams).values()) if streams.actuators.content else Refusal()


def _slow(rates: Iterable[SampleRate]) -> Refusal:
    slow = [found for found in rates if found.rate and found.fault]
    remedies = dict.fromkeys(found.remedy for found in slow if found.remedy)
    return Refusal(tuple(found.fault for found in slow), tuple(remedies))


def missing_signals(log: AutopilotLog, *, raw_outputs: bool) -> tuple[str, ...]:
    """What a log lacks at any rate: IMU, airspeed or controls, one clock, or a flight as a fixed wing."""
    useless = _useless(log, raw_outputs=raw_outputs)
    airspeed, controls = missing_airspeed(log), missing_controls(log, raw_outputs=raw_outputs)
    return useless or tuple(reason for reason in (airspeed, controls) if reason)


def _useless(log: AutopilotLog, *, raw_outputs: bool) -> tuple[str, ...]:
    """Why nothing of a log can be used."""
    if not len(log.imu):
        return (log.lacks.get(IMU) or f"no {log.imu.source} in it; {log.remedies.get(IMU, 'record it too')}",)
    faults = clock_faults(log, raw_outputs=raw_outputs)
    if faults:
        return (f"{next(iter(faults.values()))} (a clock was set); cut the log there",)
    if log.flown is not None and not log.flown:
        return (
            f"{log.autopilot} never flew as a fixed wing in it (on the ground, or hovering); give a log of a flight",
        )
    return ()


def clock_faults(log: AutopilotLog, *, raw_outputs: bool = False) -> Mapping[str, str]:
    """By role, what is wrong with the stamps of IMU, airspeed and controls: a step back of more than a second."""
    commands = log.outputs if raw_outputs or not log.controls.names else log.controls
    signals = {IMU: log.imu, AIRSPEED: log.airspeed, CONTROLS: commands.signal}
    faults = {}
    for role, signal in signals.items():
        steps = np.diff(signal.stamp_ns)
        if steps.size and int(steps.min()) < -STEP_BACK_NS:
            place = int(np.argmin(steps))
            after = (int(signal.stamp_ns[place]) - int(signal.stamp_ns[0])) / 1e9
            faults[role] = f"the stamps of {signal.source} go back by {-steps[place] / 1e9:.1f} s after {after:.1f} s"
    return faults


def step_back(stamps: Stamps) -> float:
    """By how much a clock was set back at most, s: how far a stamp is before the latest one of those before it.

    Messages without a stamp are left out when they are read, and here.
    """
    stamped = stamps[stamps > 0]
    return float((np.maximum.accumulate(stamped) - stamped).max(initial=0)) / 1e9


def missing_airspeed(log: AutopilotLog) -> str:
    """What is wrong with the airspeed in the part that was flown, or an empty text."""
    name = log.airspeed.source
    values = log.airspeed.values[within(log.flown or None, log.airspeed.stamp_ns), 0]
    if not values.size:
        return log.lacks.get(AIRSPEED) or f"no {name} in it; connect an airspeed sensor, and log it"
    if not np.isfinite(values).any():
        return log.lacks.get(AIRSPEED) or f"{name} never comes from a sensor; connect an airspeed sensor"
    if float(np.nanmax(values)) < _SLOWEST:
        return f"{name} is {float(np.nanmax(values)):.1f} m/s at most: the airspeed sensor did not work"
    return ""


def missing_controls(log: AutopilotLog, *, raw_outputs: bool) -> str:
    """Why no commands of the controls are known, or an empty text."""
    known = len(log.outputs.signal) if raw_outputs else log.controls.names and len(log.controls.signal)
    if known:
        return ""
    if CONTROLS in log.lacks:
        return log.lacks[CONTROLS]
    if raw_outputs:
        return f"no {log.outputs.signal.source} in it; {log.remedies.get(CONTROLS, 'record it too')}"
    why = log.unmapped or f"no {log.controls.signal.source} in it"
    return (
        f"which output moves which surface is not known ({why}); write it into the aircraft file, "
        'e.g. outputs: "elevator=out2:1500:0.001 aileron=out1:1500:0.001"'
    )
