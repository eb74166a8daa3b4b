"""A copy of a Gazebo model with the difference of two aircraft files written into it.

The numbers of its plugin AdvancedLiftDrag, the gains of its joints' controllers, the motor and the mass of the link
that carries the plugin are changed; everything else stays as it was, comments included.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.correcting.gazebo_masses import change_masses
from sysid_node.sim.correcting.xml_editing import document_text, read_document, text_element
from sysid_node.sim.export.exported import Exported
from sysid_node.sim.export.folding import FOLDED, folded, thrust_factor
from sysid_node.sim.export.gazebo.model import HELD, NAMES, WHY, explained, read_back
from sysid_node.sim.export.gazebo.parts import joint_angles
from sysid_node.sim.export.losses import differences, late_failures, not_held
from sysid_node.sim.export.servos import first_order_lags, second_order_line
from sysid_node.sim.export.steady import Coefficients, Columns, SteadyModel
from sysid_node.sim.importing.gazebo.motion import controllers_of
from sysid_node.sim.importing.gazebo.read import read_gazebo

Array = NDArray[np.float64]

#: The plugin's letter of each regressor.
_LETTERS = {"alpha": "a", "beta": "b", "p": "p", "q": "q", "r": "r"}

#: Numbers of symmetric flight that have an offset.
_OFFSETS = {"CL": "CL0", "CD": "CD0", "Cm": "Cem0"}

#: A change of a number that is none.
_NOTHING = 1e-7

#: How often the numbers are corrected by what the written model lacks.
_CORRECTIONS = 4


@dataclass(frozen=True)
class _Copy:
    """The document that is changed, and the aircraft before and after, about the same level flight."""

    prolog: str
    root: Element
    plugin: Element
    before: SteadyModel
    after: SteadyModel
    original: Coefficients

    @property
    def text(self) -> str:
        return document_text(self.prolog, self.root)

    def written(self) -> Coefficients:
        """The coefficients of the aircraft before, with what the written model has other than the original."""
        now = read_back(self.text, self.before.aircraft)

        def coefficients(x: Columns) -> Array:
            return self.before(x) + now(x) - self.original(x)

        return coefficients


def corrected_sdf(path: Path, after: Aircraft) -> Exported:
    """The SDF of a model with what ``after`` has other than it, and what that is not in it.

    The model is read about level flight at the aircraft's reference airspeed, as ``sysid import`` does.
    Raises InputError where it is another aircraft's or has no single plugin AdvancedLiftDrag.
    """
    copy = _copy(path, after)
    old, new = copy.before.effects, copy.after.effects
    shift = {axis: new.get("cg_shift", {}).get(axis, 0.0) - old.get("cg_shift", {}).get(axis, 0.0) for axis in "xyz"}
    change_masses(copy.root, path, copy.plugin, copy.before.aircraft, copy.after.aircraft, shift)
    for _ in range(_CORRECTIONS):
        _correct(copy, copy.written())
    changed = {name: values for name, values in new.items() if values != old.get(name)}
    lines = [*_change_servos(copy), *_change_motor(copy), *second_order_line(changed)]
    lines += [*not_held(changed, HELD, WHY), *late_failures(changed), *differences(copy.after, copy.written())]
    return Exported(copy.text, tuple(explained(line) for line in lines), frozenset((*HELD, *FOLDED)))


def _copy(path: Path, after: Aircraft) -> _Copy:
    prolog, root = read_document(path)
    plugins = [p for p in root.iter("plugin") if (p.get("name") or "").rpartition("::")[2] == "AdvancedLiftDrag"]
    if len(plugins) != 1 or any("LiftDrag" in (p.get("name") or "") for p in root.iter("plugin") if p not in plugins):
        raise InputError(f"--model {path}: it needs one plugin AdvancedLiftDrag and no LiftDrag; leave --model out")
    before = read_gazebo(path, after.reference.airspeed).aircraft
    if {c.symbol: dict(c.joints) for c in before.controls.values()} != {
        c.symbol: dict(c.joints) for c in after.controls.values()
    }:
        raise InputError(
            f"--model {path}: the aircraft {after.name!r} has other controls; it must be read from this file"
        )
    models = [SteadyModel(*folded(aircraft, aircraft.effect_values())) for aircraft in (before, after)]
    later = replace(models[1], flight=models[0].level)
    return _Copy(prolog, root, plugins[0], models[0], later, read_back(document_text(prolog, root), before))


def _correct(copy: _Copy, written: Coefficients) -> None:
    """Add to the plugin's numbers what the written model's slopes and level flight lack."""
    file, aircraft = copy.after, copy.after.aircraft
    added = dict.fromkeys(NAMES, 0.0)  # in level flight, by slopes
    for name in file.regressors:
        lack = dict(zip(NAMES, (file.slope(file, name) - file.slope(written, name)).tolist(), strict=True))
        if name in _LETTERS:
            for c, value in lack.items():
                if not (c == "CD" and name in ("alpha", "beta")):
                    added[c] += _add(copy.plugin, NAMES[c] + _LETTERS[name], value) * file.level[name]
            continue
        control = next(c for c in aircraft.controls.values() if c.symbol == name)
        for c, value in lack.items():
            added[c] += value * file.level[name]
            for surface in copy.plugin.findall("control_surface"):
                joint, direction = (surface.findtext("name") or "").strip(), float(surface.findtext("direction") or 1.0)
                _add(surface, f"{NAMES[c]}_ctrl", control.joints.get(joint, 0.0) * math.radians(value) / direction)
    lack = dict(zip(NAMES, (file.here(file) - file.here(written)).tolist(), strict=True))
    for c, tag in _OFFSETS.items():
        _add(copy.plugin, tag, lack[c] - added[c])


def _add(parent: Element, tag: str, value: float) -> float:
    """Add to a number, and say what was added; what is too little to matter leaves the number as it stands."""
    element = parent.find(tag)
    if abs(value) < _NOTHING:
        return 0.0
    _set(parent, tag, (float(element.text or 0.0) if element is not None else 0.0) + value)
    return value


def _set(parent: Element, tag: str, value: float) -> None:
    element = parent.find(tag)
    text = f"{value:.12g}"
    if element is None:
        text_element(parent, tag, text).tail = "\n      "
    else:
        element.text = text


def _plugins(copy: _Copy, kind: str) -> list[Element]:
    return [p for p in copy.root.iter("plugin") if (p.get("name") or "").rpartition("::")[2] == kind]


def _change_servos(copy: _Copy) -> list[str]:
    """Gains and largest commands of the joints' controllers; a line for each servo that cannot be changed."""
    old, new = copy.before.effects, copy.after.effects
    lags, lagged = first_order_lags(old), first_order_lags(new)
    rates, limited = (e.get("actuator_rate_limit", {}) for e in (old, new))
    lines = []
    for name, control in copy.after.aircraft.controls.items():
        slower = abs(lagged.get(name, 0.0) - lags.get(name, 0.0)) > 1e-12
        slowed = limited.get(name, math.inf) != rates.get(name, math.inf)
        if not slower and not slowed:
            continue
        for joint in control.joints:
            reach = _angle_per_unit(copy.after.aircraft, control.symbol, joint)
            done = _change_servo(copy, joint, lagged.get(name, 0.0), limited.get(name, math.inf) * reach)
            if not done:
                effect = "actuator_lag" if slower else "actuator_rate_limit"
                why = "has no JointPositionController against a damping"
                if not lagged.get(name) and lags.get(name):
                    why = f"keeps its lag of {lags[name]:.3g} s; a controller against a damping cannot do without one"
                lines.append(f"{effect}: joint {joint} {why}")
    return lines


def _change_servo(copy: _Copy, joint: str, lag: float, rate: float) -> bool:
    controllers = controllers_of(_plugins(copy, "JointPositionController"))
    damping = copy.root.findtext(f".//joint[@name='{joint}']/axis/dynamics/damping")
    controller = controllers.get(joint)
    if controller is None or not damping or controller.find("use_velocity_commands") is not None or not lag:
        return False
    resisting = float(damping)
    _set(controller, "p_gain", resisting / lag)
    if math.isfinite(rate):
        _set(controller, "cmd_max", rate * resisting)
        _set(controller, "cmd_min", -rate * resisting)
    return True


def _angle_per_unit(aircraft: Aircraft, symbol: str, joint: str) -> float:
    unit: Mapping[str, Array] = {s: np.array([1.0 if s == symbol else 0.0]) for s in aircraft.control_symbols}
    return abs(float(joint_angles(aircraft, unit)[joint][0]))


def _change_motor(copy: _Copy) -> list[str]:
    """The motor's constant and time constants; a line for each change that needs the rotor moved."""
    motors = _plugins(copy, "MulticopterMotorModel")
    old, new = copy.before, copy.after
    then, now = old.aircraft.throttle, new.aircraft.throttle
    lines = []
    if then is not None and now is not None and motors:
        ratio = (now.max_thrust or 1.0) * thrust_factor(new.effects)
        ratio /= (then.max_thrust or 1.0) * thrust_factor(old.effects)
        if abs(ratio - 1.0) > 1e-9:
            _set(motors[0], "motorConstant", float(motors[0].findtext("motorConstant") or 8.54858e-06) * ratio)
        if (then.arm, then.inclination) != (now.arm, now.inclination):
            arm = now.arm - then.arm
            lines.append(f"thrust_line_offset: lower the rotor's link by {arm:.3g} m; its place is left as it is")
    lag, lagged = (m.effects.get("motor_lag", {}).get("time_constant", 0.0) for m in (old, new))
    if lag != lagged and motors:
        for tag in ("timeConstantUp", "timeConstantDown"):
            _set(motors[0], tag, lagged)
        lines.append("motor_lag: the rotor's speed lags in Gazebo, not its thrust; for small changes it is the same")
    if new.effects.get("thrust_yaw", {}) != old.effects.get("thrust_yaw", {}):
        lines.append("thrust_yaw: move the rotor's link and set momentConstant yourself; they are left as they are")
    return lines
