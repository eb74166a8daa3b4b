"""Which joints are elevator, aileron and rudder: told by the moments that they make."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Control

Array = NDArray[np.float64]

_SYMBOLS = {"elevator": "de", "aileron": "da", "rudder": "dr"}
_ROLL, _PITCH, _YAW = 3, 4, 5


def controls_of(power: Mapping[str, Array], limits: Mapping[str, float]) -> dict[str, Control]:
    """Controls from each joint's coefficients per rad (6,): together they hold every joint's effect.

    Two joints that roll against each other and pitch alike are a pair: its difference is a control, and its sum
    another. The pair of the strongest roll is the aileron, the control of the strongest pitch the elevator, of the
    strongest yaw the rudder; all others get names and symbols of their own. Signs are those of the aircraft file.
    """
    pairs = _pairs(power)
    single = [joint for joint in power if joint not in {j for pair in pairs for j in pair}]
    raw: dict[str, tuple[dict[str, float], Array]] = {}
    for left, right in pairs:
        difference = {left: -0.5, right: 0.5}
        raw[f"{left} against {right}"] = (difference, power[right] - power[left])
        raw[f"{left} with {right}"] = ({left: 0.5, right: 0.5}, power[left] + power[right])
    raw |= {joint: ({joint: 1.0}, power[joint]) for joint in single}
    controls: dict[str, Control] = {}
    rest = dict(raw)
    for name, axis in (("aileron", _ROLL), ("elevator", _PITCH), ("rudder", _YAW)):
        best = max(rest, key=lambda key: abs(rest[key][1][axis]), default=None)
        if best is None or not rest[best][1][axis]:
            continue
        joints, effect = rest.pop(best)
        sign = -1.0 if effect[axis] > 0.0 else 1.0
        controls[name] = _control(name, _SYMBOLS[name], {j: sign * s for j, s in joints.items()}, limits)
    for number, (joints, _) in enumerate(rest.values(), 1):
        name = "flap" if number == 1 else f"flap{number}"
        controls[name] = _control(name, "df" if number == 1 else f"df{number}", joints, limits)
    return {name: controls[name] for name in (*_SYMBOLS, *controls) if name in controls}


def joint_angles(controls: Mapping[str, Control], deflections: Mapping[str, Array]) -> dict[str, Array]:
    """Angles of the joints (rad) at deflections of the controls, by symbol: the inverse of the controls."""
    joints = sorted({joint for control in controls.values() for joint in control.joints})
    if not joints:
        return {}
    matrix = np.array([[control.joints.get(joint, 0.0) for joint in joints] for control in controls.values()])
    values = np.array([deflections[control.symbol] for control in controls.values()])
    return dict(zip(joints, np.linalg.solve(matrix, values), strict=True))


def _pairs(power: Mapping[str, Array]) -> list[tuple[str, str]]:
    """Pairs of joints that are each other's mirror image; the first is the left one by its roll to the right."""
    found: list[tuple[str, str]] = []
    mirror = np.array([1.0, 1.0, -1.0, -1.0, 1.0, -1.0])
    for first, second in combinations(power, 2):
        taken = {joint for pair in found for joint in pair}
        size = float(np.abs(power[first]).max())
        alike = np.abs(power[first] - mirror * power[second]).max() <= 1e-3 * size
        if alike and abs(power[first][_ROLL]) > 1e-9 and not {first, second} & taken:
            found.append((first, second))
    return found


def _control(name: str, symbol: str, joints: Mapping[str, float], limits: Mapping[str, float]) -> Control:
    reach = sum(abs(scale) * limits.get(joint, math.pi / 4.0) for joint, scale in joints.items())
    return Control(name, symbol, dict(joints), limit=min(reach, math.pi / 2.0))
