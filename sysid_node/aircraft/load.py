"""Loads aircraft files: every value is checked, and every mistake is one line that names file, line and key."""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sysid_node.aircraft.document import Entry, did_you_mean, parse_document
from sysid_node.aircraft.model import (
    DEFAULT_NOISE,
    Aircraft,
    Control,
    Derivative,
    Geometry,
    Inertia,
    Reference,
    Sensors,
    Throttle,
    Vector3,
)
from sysid_node.aircraft.names import (
    COEFFICIENTS,
    CONTROL_SYMBOLS,
    RESERVED_SYMBOLS,
    STATE_REGRESSORS,
    split_derivative,
)
from sysid_node.errors import InputError

_REQUIRED = {
    "name": "the aircraft's name",
    "mass": "the mass in kg",
    "geometry": "the reference area, span and chord: {S: , b: , cbar: }",
    "reference": "the flight condition of the derivatives: {airspeed: , air_density: }",
    "controls": "the control surfaces, e.g. elevator: {joint: elevator}",
    "derivatives": "the derivatives of the model, e.g. Cm_alpha: {value: -0.5}",
}


def load_aircraft(name_or_path: str | Path) -> Aircraft:
    """The aircraft of a file, or one that comes with the package, by name (``"cdrw"``).

    A ``str`` that ends in .yaml or .yml or holds a path separator is a file, any other a name.
    Raises InputError (one line: file, line, dotted key, the value, what was expected).
    """
    path = _find(name_or_path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"aircraft file {path}: not found; give a file or one of {_known_names()}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"aircraft file {path}: cannot be read: {error}") from error
    return parse_aircraft(text, str(path))


def parse_aircraft(text: str, file: str = "<text>") -> Aircraft:
    """The aircraft that a YAML text describes; ``file`` is the name that errors give. Raises InputError."""
    top = parse_document(text, file)
    fields = top.fields(_REQUIRED, optional=("source", "inertia", "noise", "sensors"))
    controls, throttle = _controls(fields["controls"])
    return Aircraft(
        name=fields["name"].text("the aircraft's name"),
        source=fields["source"].text("text: where the numbers are from") if "source" in fields else "",
        mass=_positive(fields["mass"], "kg"),
        inertia=_inertia(fields.get("inertia")),
        geometry=_geometry(fields["geometry"]),
        reference=_reference(fields["reference"]),
        controls=controls,
        derivatives=_derivatives(fields["derivatives"], controls),
        throttle=throttle,
        sensors=_sensors(fields.get("sensors")),
        noise=_noise(fields.get("noise")),
    )


def aircraft_folders() -> list[Path]:
    """The folders that are searched for named aircraft: the source tree, then the share folder of the package."""
    prefixes = [sys.prefix, *os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)]
    candidates = [Path(__file__).resolve().parents[2] / "config" / "aircraft"]
    candidates += [Path(prefix) / "share" / "sysid_node" / "config" / "aircraft" for prefix in prefixes if prefix]
    return [folder for folder in candidates if folder.is_dir()]


def _find(name_or_path: str | Path) -> Path:
    name = str(name_or_path)
    if isinstance(name_or_path, Path) or name.endswith((".yaml", ".yml")) or os.sep in name:
        return Path(name_or_path)
    for folder in aircraft_folders():
        if name and (folder / f"{name}.yaml").is_file():
            return folder / f"{name}.yaml"
    raise InputError(f"aircraft {name!r} is not known; give a .yaml file or one of {_known_names()}")


def _known_names() -> str:
    names = {path.stem for folder in aircraft_folders() for path in folder.glob("*.yaml")}
    return ", ".join(sorted(names)) or "none (no aircraft are installed)"


def _positive(entry: Entry, unit: str) -> float:
    return entry.number(f"a positive number ({unit})", lambda x: x > 0)


def _angle(entry: Entry) -> float:
    return entry.number("an angle in rad, at most pi/2 (is it in degrees?)", lambda x: abs(x) <= math.pi / 2)


def _inertia(entry: Entry | None) -> Inertia:
    """The inertia. A moment that is left out is NaN (unknown); Ixz is then zero, as in a symmetric aircraft."""
    if entry is None:
        return Inertia(math.nan, math.nan, math.nan, math.nan)
    fields = entry.fields({}, optional=("Ixx", "Iyy", "Izz", "Ixz"))
    Ixx, Iyy, Izz = (_positive(fields[k], "kg m^2") if k in fields else math.nan for k in ("Ixx", "Iyy", "Izz"))
    Ixz = fields["Ixz"].number("a number (kg m^2)") if "Ixz" in fields else 0.0
    inertia = Inertia(Ixx, Iyy, Izz, Ixz)
    _check_inertia(entry, inertia)
    return inertia


def _check_inertia(entry: Entry, inertia: Inertia) -> None:
    """Raise an error where no rigid body has these moments. Unknown moments (NaN) are not checked."""
    moments = {"Ixx": inertia.Ixx, "Iyy": inertia.Iyy, "Izz": inertia.Izz}
    for name, moment in moments.items():
        others = {k: v for k, v in moments.items() if k != name}
        if moment > sum(others.values()):
            raise entry.error(
                f"no rigid body has {name} = {moment:g} > {' + '.join(others)} = "
                f"{sum(others.values()):g} kg m^2; check the three moments"
            )
    if inertia.Ixz**2 >= inertia.Ixx * inertia.Izz:
        raise entry.error(
            f"no rigid body has Ixz^2 = {inertia.Ixz**2:g} >= Ixx Izz = {inertia.Ixx * inertia.Izz:g}; check Ixz"
        )


def _geometry(entry: Entry) -> Geometry:
    fields = entry.fields({"S": "the reference area in m^2", "b": "the span in m", "cbar": "the mean chord in m"})
    S, b, cbar = (_positive(fields[k], unit) for k, unit in (("S", "m^2"), ("b", "m"), ("cbar", "m")))
    # S is b times a mean chord; whichever mean was meant, a factor of 3 shows a wrong unit.
    if not 1 / 3 < S / (b * cbar) < 3:
        raise entry.error(f"S = {S:g} m^2 does not go with b cbar = {b * cbar:g} m^2; check the units")
    return Geometry(S, b, cbar)


def _reference(entry: Entry) -> Reference:
    fields = entry.fields({"airspeed": "the true airspeed in m/s", "air_density": "the air density in kg/m^3"})
    return Reference(
        airspeed=_positive(fields["airspeed"], "m/s"),
        air_density=fields["air_density"].number("an air density (0 to 2 kg/m^3)", lambda x: 0 < x < 2),
    )


def _controls(entry: Entry) -> tuple[dict[str, Control], Throttle | None]:
    entries = entry.mapping("a mapping from control to its joints, e.g. elevator: {joint: elevator}")
    throttle = _throttle(entries.pop("throttle")) if "throttle" in entries else None
    controls = {name: _control(name, item) for name, item in entries.items()}
    _check_symbols(entries, controls)
    _check_joints(entries, controls, throttle)
    return controls, throttle


def _control(name: str, entry: Entry) -> Control:
    fields = entry.fields({}, optional=("joint", "scale", "joints", "offset", "limit", "symbol"))
    return Control(
        name=name,
        symbol=_symbol(name, entry, fields.get("symbol")),
        joints=_joints(entry, fields),
        offset=_angle(fields["offset"]) if "offset" in fields else 0.0,
        limit=_limit(fields["limit"]) if "limit" in fields else None,
    )


def _limit(entry: Entry) -> float:
    return entry.number("a positive angle in rad, at most pi/2 (is it in degrees?)", lambda x: 0 < x <= math.pi / 2)


def _symbol(name: str, control: Entry, symbol: Entry | None) -> str:
    standard = CONTROL_SYMBOLS.get(name)
    if symbol is None:
        if standard is None:
            known = ", ".join((*CONTROL_SYMBOLS, "throttle"))
            hint = did_you_mean(name, (*CONTROL_SYMBOLS, "throttle"))
            raise control.error(f"not one of {known}{hint}; a further control needs a symbol, e.g. symbol: df")
        return standard
    text = symbol.text("a symbol, e.g. df")
    if standard is not None and text != standard:
        raise symbol.error(f"got {text!r}, but the {name}'s symbol is {standard!r}; leave it out")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", text) or text in RESERVED_SYMBOLS:
        raise symbol.error(f"got {text!r}, expected lower-case letters and digits, e.g. df, not a signal's own name")
    return text


def _joints(entry: Entry, fields: Mapping[str, Entry]) -> dict[str, float]:
    """``joint`` with ``scale``, or ``joints`` with a scale each."""
    nonzero = "a number other than zero (rad of control per rad of joint)"
    if ("joint" in fields) == ("joints" in fields):
        raise entry.error("expected either joint: NAME or joints: {NAME: SCALE, ...}")
    if "joint" in fields:
        scale = fields["scale"].number(nonzero, lambda x: x != 0) if "scale" in fields else 1.0
        return {fields["joint"].text("the joint's name"): scale}
    if "scale" in fields:
        raise fields["scale"].error("goes with joint: NAME; with joints each has its own scale")
    joints = fields["joints"].mapping("a mapping from joint to scale, e.g. {left: 0.5, right: -0.5}")
    if not joints:
        raise fields["joints"].error("no joint given; expected e.g. {left: 0.5, right: -0.5}")
    return {name: item.number(nonzero, lambda x: x != 0) for name, item in joints.items()}


def _check_symbols(entries: Mapping[str, Entry], controls: Mapping[str, Control]) -> None:
    owner: dict[str, str] = {}
    for name, control in controls.items():
        if control.symbol in owner:
            raise entries[name].error(f"symbol {control.symbol!r} is already that of {owner[control.symbol]!r}")
        owner[control.symbol] = name


def _check_joints(entries: Mapping[str, Entry], controls: Mapping[str, Control], throttle: Throttle | None) -> None:
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


def _throttle(entry: Entry) -> Throttle:
    meaning = {"joint": "the name of the joint that carries throttle or thrust"}
    fields = entry.fields(meaning, optional=("max_thrust", "unit", "inclination", "arm"))
    if ("max_thrust" in fields) == ("unit" in fields):
        raise entry.error("expected either max_thrust: N at full throttle, or unit: newton")
    if "unit" in fields and fields["unit"].text("newton") != "newton":
        raise fields["unit"].mismatch("newton")
    return Throttle(
        joint=fields["joint"].text("the joint's name"),
        max_thrust=_positive(fields["max_thrust"], "N") if "max_thrust" in fields else None,
        inclination=_angle(fields["inclination"]) if "inclination" in fields else 0.0,
        arm=fields["arm"].number("a number (m)") if "arm" in fields else 0.0,
    )


def _derivatives(entry: Entry, controls: Mapping[str, Control]) -> dict[str, Derivative]:
    entries = entry.mapping("a mapping from derivative to {value: , tolerance: }")
    if not entries:
        raise entry.error("no derivative given; expected e.g. Cm_alpha: {value: -0.5}")
    symbols = {control.symbol for control in controls.values()}
    for name, item in entries.items():
        _check_derivative_name(name, item, symbols)
    if "CD_k" in entries and "CD_alpha" in entries:
        raise entries["CD_k"].error("stands in place of CD_alpha, which is given too; keep one")
    return {name: _derivative(item) for name, item in entries.items()}


def _check_derivative_name(name: str, entry: Entry, symbols: set[str]) -> None:
    regressors = [*STATE_REGRESSORS, *sorted(symbols)]
    try:
        coefficient, regressor = split_derivative(name)
    except ValueError as error:
        known = [f"{c}_{r}" for c in COEFFICIENTS for r in regressors]
        raise entry.error(f"{error}{did_you_mean(name, known)}") from error
    if regressor not in regressors:
        raise entry.error(f"{regressor!r} is none of {', '.join(regressors)}; a further control must be in controls")
    if regressor == "k" and coefficient != "CD":
        raise entry.error("the regressor k (CL^2) is for CD only")


def _derivative(entry: Entry) -> Derivative:
    fields = entry.fields({"value": "the derivative, per radian"}, optional=("tolerance",))
    value = fields["value"].number("a number (per rad)")
    if "tolerance" not in fields:
        return Derivative(value)
    expected = "a positive number, 1 sigma in the derivative's unit (leave it out where it is not known)"
    return Derivative(value, fields["tolerance"].number(expected, lambda x: x > 0))


def _sensors(entry: Entry | None) -> Sensors:
    fields = entry.fields({}, optional=("imu", "air_data")) if entry is not None else {}
    return Sensors(**{name: _vector(item) for name, item in fields.items()})


def _vector(entry: Entry) -> Vector3:
    expected = "three numbers [x, y, z] in m from the CG, forward, right, down"
    items = entry.items(expected)
    if len(items) != 3:
        raise entry.error(f"got {len(items)} values, expected {expected}")
    x, y, z = (item.number("a number (m)") for item in items)
    return x, y, z


def _noise(entry: Entry | None) -> dict[str, float]:
    fields = entry.fields({}, optional=tuple(DEFAULT_NOISE)) if entry is not None else {}
    given = {name: item.number("a number, 1 sigma, not negative", lambda x: x >= 0) for name, item in fields.items()}
    return {**DEFAULT_NOISE, **given}
