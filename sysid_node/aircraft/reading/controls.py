"""The block ``controls`` of an aircraft file: controls, their joints, and the throttle."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

from sysid_node.aircraft.document import DocumentEntry
from sysid_node.aircraft.model import Control, Throttle
from sysid_node.aircraft.names import CONTROL_SYMBOLS, RESERVED_SYMBOLS
from sysid_node.aircraft.reading.quantities import Quantities, ReadNumber, angle, any_number
from sysid_node.suggestion import did_you_mean

#: The largest number of controls: twice the outputs of an autopilot. What is made of all pairs of them stays small.
MOST_CONTROLS = 32


def read_controls(entry: DocumentEntry, quantities: Quantities) -> tuple[dict[str, Control], Throttle | None]:
    """The controls by name, and the throttle. Raises InputError."""
    entries = entry.mapping("a mapping from control to its joints, e.g. elevator: {joint: elevator}")
    throttle = _throttle(entries.pop("throttle"), quantities) if "throttle" in entries else None
    if len(entries) > MOST_CONTROLS:
        raise entry.error(f"{len(entries)} controls, expected at most {MOST_CONTROLS}")
    controls = {name: _control(name, item, quantities) for name, item in entries.items()}
    _check_symbols(entries, controls)
    _check_joints(entries, controls, throttle)
    return controls, throttle


def _control(name: str, entry: DocumentEntry, quantities: Quantities) -> Control:
    fields = entry.fields({}, optional=("joint", "scale", "joints", "offset", "limit", "full_deflection", "symbol"))
    key = f"controls.{name}"
    return Control(
        name=name,
        symbol=_symbol(name, entry, fields.get("symbol")),
        joints=_joints(entry, fields, key, quantities),
        offset=quantities.read(fields["offset"], f"{key}.offset", angle) if "offset" in fields else 0.0,
        limit=quantities.read(fields["limit"], f"{key}.limit", _limit) if "limit" in fields else None,
        full_deflection=_full_deflection(fields["full_deflection"]) if "full_deflection" in fields else None,
    )


def _full_deflection(entry: DocumentEntry) -> float:
    expected = "an angle in rad other than zero, at most pi/2 (is it in degrees?)"
    return entry.number(expected, lambda x: 0 < abs(x) <= math.pi / 2)


def _limit(entry: DocumentEntry) -> float:
    return entry.number("a positive angle in rad, at most pi/2 (is it in degrees?)", lambda x: 0 < x <= math.pi / 2)


def _symbol(name: str, control: DocumentEntry, symbol: DocumentEntry | None) -> str:
    standard = CONTROL_SYMBOLS.get(name)
    if symbol is None:
        if standard is None:
            names = ", ".join((*CONTROL_SYMBOLS, "throttle"))
            named = next((known for known, its_symbol in CONTROL_SYMBOLS.items() if its_symbol == name), name)
            hint = did_you_mean(named, (*CONTROL_SYMBOLS, "throttle"))
            raise control.error(f"not one of {names}{hint}; a further control needs a symbol, e.g. symbol: df")
        return standard
    text = symbol.text("a symbol, e.g. df")
    if standard is not None and text != standard:
        raise symbol.error(f"got {text!r}, but the {name}'s symbol is {standard!r}; leave it out")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", text) or text in RESERVED_SYMBOLS:
        raise symbol.error(f"got {text!r}, expected lower-case letters and digits, e.g. df, not a signal's own name")
    return text


def _scale(entry: DocumentEntry) -> float:
    return entry.number("a number other than zero (rad of control per rad of joint)", lambda x: x != 0)


def _joints(
    entry: DocumentEntry, fields: Mapping[str, DocumentEntry], key: str, quantities: Quantities
) -> dict[str, float]:
    """``joint`` with ``scale``, or ``joints`` with a scale each."""
    if ("joint" in fields) == ("joints" in fields):
        raise entry.error("expected either joint: NAME or joints: {NAME: SCALE, ...}")
    if "joint" in fields:
        scale = quantities.read(fields["scale"], f"{key}.scale", _scale) if "scale" in fields else 1.0
        return {fields["joint"].text("the joint's name"): scale}
    if "scale" in fields:
        raise fields["scale"].error("goes with joint: NAME; with joints each has its own scale")
    joints = fields["joints"].mapping("a mapping from joint to scale, e.g. {left: 0.5, right: -0.5}")
    if not joints:
        raise fields["joints"].error("no joint given; expected e.g. {left: 0.5, right: -0.5}")
    if len(joints) == 1:  # the same as joint and scale
        return {name: quantities.read(item, f"{key}.scale", _scale) for name, item in joints.items()}
    return {name: quantities.read(item, f"{key}.joints.{name}", _scale) for name, item in joints.items()}


def _check_symbols(entries: Mapping[str, DocumentEntry], controls: Mapping[str, Control]) -> None:
    owner: dict[str, str] = {}
    for name, control in controls.items():
        if control.symbol in owner:
            raise entries[name].error(f"symbol {control.symbol!r} is already that of {owner[control.symbol]!r}")
        owner[control.symbol] = name


def _check_joints(
    entries: Mapping[str, DocumentEntry], controls: Mapping[str, Control], throttle: Throttle | None
) -> None:
    """Raise an error where the controls are dependent combinations of joints: their derivatives would be collinear."""
    joints = sorted({joint for control in controls.values() for joint in control.joints})
    rows: list[list[float]] = []
    for name, control in controls.items():
        if throttle is not None and throttle.joint in control.joints:
            raise entries[name].error(f"joint {throttle.joint!r} is already the throttle's")
        row = [control.joints.get(joint, 0.0) for joint in joints]
        size = math.hypot(*row)
        rows.append([scale / size for scale in row])
        if np.linalg.matrix_rank(np.array(rows), tol=1e-6) < len(rows):
            raise entries[name].error(
                f"joints {', '.join(control.joints)} give no control independent of those before it; "
                "its derivatives could not be told apart from theirs"
            )


def _thrust(entry: DocumentEntry) -> float:
    return entry.number("at least 0.001 (N)", lambda x: x >= 1e-3)


def _throttle(entry: DocumentEntry, quantities: Quantities) -> Throttle:
    meaning = {"joint": "the name of the joint that carries throttle or thrust"}
    fields = entry.fields(meaning, optional=("max_thrust", "unit", "inclination", "arm"))
    if ("max_thrust" in fields) == ("unit" in fields):
        raise entry.error("expected either max_thrust: N at full throttle, or unit: newton")
    if "unit" in fields and fields["unit"].text("newton") != "newton":
        raise fields["unit"].mismatch("newton")

    def read(name: str, number: ReadNumber, absent: float | None) -> float | None:
        return quantities.read(fields[name], f"throttle.{name}", number) if name in fields else absent

    return Throttle(
        joint=fields["joint"].text("the joint's name"),
        max_thrust=read("max_thrust", _thrust, None),
        inclination=read("inclination", angle, 0.0) or 0.0,
        arm=read("arm", any_number("m"), 0.0) or 0.0,
    )
