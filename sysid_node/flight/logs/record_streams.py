"""The samples of a flight, aligned already, as streams of messages."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.flight.streams import AirDataStream, ImuStream, JointStream, Streams, arrivals_in_stamp_order

#: Joints for the controls of a log -> the controls' symbols; thrust is in N.
STANDARD_JOINTS = MappingProxyType({"elevator": "de", "aileron": "da", "rudder": "dr"})
THROTTLE_JOINT = "throttle"

_START_NS = 1_000_000_000  # first stamp of a log without a date, as a stamp of zero means that there is none
_NEEDED = ("ax", "ay", "az", "p", "q", "r", "V")


def streams_from_record(flight: FlightRecord, aircraft: Aircraft | None = None) -> Streams:
    """The messages of a flight: one on each topic per sample, stamped from the flight's start.

    The joints are those of the aircraft, by the inverse of its map, where one is given; otherwise ``elevator``,
    ``aileron`` and ``rudder``, with thrust in N as ``throttle``. Raises InputError where a needed column is missing.
    """
    missing = missing_columns(flight, standard=aircraft is None)
    if missing:
        raise InputError(f"flight {flight.name!r}: {missing}")
    return _streams(flight, _standard_joints(flight) if aircraft is None else _aircraft_joints(flight, aircraft))


def missing_columns(flight: FlightRecord, *, standard: bool = True) -> str:
    """The columns without values that a bag cannot do without, or "". ``standard`` joints are not an aircraft's."""
    missing = [column for column in _NEEDED if not flight.measured(column)]
    if missing:
        return f"no values in {', '.join(missing)}; a bag needs them"
    joints = _standard_joints(flight)
    return "no values in de, da, dr or thrust; a bag needs one of them" if standard and not joints else ""


def incomplete_streams(flight: FlightRecord) -> Streams:
    """As ``streams_from_record``, with NaN where nothing was measured, and without joints where no control was."""
    return _streams(flight, _standard_joints(flight))


def _streams(flight: FlightRecord, joints: Mapping[str, Array]) -> Streams:
    since = np.round(flight.time * 1e9).astype(np.int64)
    stamps = since + (flight.start_ns or _START_NS - min(int(since[0]), 0))
    imu, air_data, actuators = arrivals_in_stamp_order(stamps, stamps, stamps)
    positions = np.column_stack(list(joints.values())) if joints else np.empty((len(flight), 0))
    return Streams(
        ImuStream(imu, _side_by_side(flight, *_NEEDED[:6]), _side_by_side(flight, "phi", "theta", "psi"), "imu"),
        AirDataStream(air_data, _side_by_side(flight, "V", "alpha", "beta", "rho")),
        JointStream(actuators, tuple(joints), positions),
        flight.name,
    )


def _side_by_side(flight: FlightRecord, *columns: str) -> Array:
    return np.column_stack([flight[column] for column in columns])


def _standard_joints(flight: FlightRecord) -> dict[str, Array]:
    """Joints equal to the controls; controls that were not measured are left out."""
    joints = {joint: flight[symbol] for joint, symbol in STANDARD_JOINTS.items() if flight.measured(symbol)}
    if flight.measured("thrust"):
        joints[THROTTLE_JOINT] = flight["thrust"]
    return joints


def _aircraft_joints(flight: FlightRecord, aircraft: Aircraft) -> dict[str, Array]:
    """The smallest joint positions from which the aircraft file's map gives the flight's controls."""
    controls = list(aircraft.controls.values())
    unmeasured = [control.symbol for control in controls if not flight.measured(control.symbol)]
    if unmeasured:
        raise InputError(f"flight {flight.name!r}: no values in {', '.join(unmeasured)}, which {aircraft.name} has")
    names = list(dict.fromkeys(joint for control in controls for joint in control.joints))
    scales = np.array([[control.joints.get(name, 0.0) for name in names] for control in controls])
    values = np.column_stack([flight[control.symbol] - control.offset for control in controls])
    joints = dict(zip(names, (values @ np.linalg.pinv(scales).T).T, strict=True))
    if aircraft.throttle is not None and flight.measured("thrust"):
        joints[aircraft.throttle.joint] = flight["thrust"] / (aircraft.throttle.max_thrust or 1.0)
    return joints
