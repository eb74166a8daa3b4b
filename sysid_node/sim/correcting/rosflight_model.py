"""A copy of ROSflight's parameters with the difference of two aircraft files written into it.

What the correction does not touch stays as it was: motor, propeller and stall, other nodes' parameters, comments.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.sim.export.exported import Exported
from sysid_node.sim.export.folding import FOLDED, folded, thrust_factor
from sysid_node.sim.export.losses import differences, late_failures, not_held
from sysid_node.sim.export.rosflight import (
    CONTROLS,
    HELD,
    NAMES,
    WHY,
    number_text,
    servo_lags,
    servo_lines,
    thrust_lines,
)
from sysid_node.sim.export.steady import Coefficients, Columns, SteadyModel
from sysid_node.sim.importing.plant import LoadFunction, PlantStates, nondimensional
from sysid_node.sim.importing.rosflight import NO_SERVO_LAG, read_rosflight, rosflight_loads

Array = NDArray[np.float64]

#: How far sizes may differ, as a share, for the parameters to be the aircraft's.
_SHARE = 0.01

#: Names of moments of inertia in comments, where rosflight_sim's own files have them.
_COMMENTS = {"Jxx": "Jx", "Jyy": "Jy", "Jzz": "Jz", "Jxz": "Jxz"}


@dataclass(frozen=True)
class _Change:
    """Two aircraft about the same level flight, with their effects that are no plain numbers."""

    before: SteadyModel
    after: SteadyModel

    def of(self, name: str) -> float:
        """What a derivative gains."""
        return self.after.derivatives.get(name, 0.0) - self.before.derivatives.get(name, 0.0)


def corrected_parameters(path: Path, after: Aircraft) -> Exported:
    """The parameters of a file with what ``after`` has other than the file.

    The file is read about level flight at the aircraft's reference airspeed, as ``sysid import`` does.
    Raises InputError where it is another aircraft's.
    """
    before = read_rosflight(path, after.reference.airspeed).aircraft
    _require_same(path, before, after)
    change = _change(before, after)
    text = path.read_text(encoding="utf-8")
    original = rosflight_loads(path)
    values = _values(change, before)
    text = _rewritten(text, path, values)
    # what is left of the drag in level flight is parasitic; the induced drag follows the lift by itself
    here = change.after.here(_written(text, original, change)) - change.after.here(change.after)
    text = _rewritten(text, path, {"C_D_p": ("add", -float(here[1]))})
    rest, old = change.after.effects, change.before.effects
    new = {name: value for name, value in rest.items() if value != old.get(name)}
    lines = [*servo_lines(after, new), *thrust_lines(change.after.aircraft, new, arms=_arms(change))]
    lines += [
        *not_held(new, HELD, WHY),
        *late_failures(new),
        *differences(change.after, _written(text, original, change)),
    ]
    return Exported(text, tuple(lines), frozenset((*HELD, *FOLDED)))


def _require_same(path: Path, before: Aircraft, after: Aircraft) -> None:
    for key in ("S", "b", "cbar"):
        theirs, ours = getattr(before.geometry, key), getattr(after.geometry, key)
        if abs(theirs - ours) > _SHARE * ours:
            raise InputError(
                f"--model {path}: its geometry.{key} is {theirs:.4g}, the aircraft {after.name!r} has {ours:.4g}; "
                "give the parameters that the aircraft file was read from"
            )
    if set(before.control_symbols) != set(after.control_symbols):
        raise InputError(
            f"--model {path}: the aircraft {after.name!r} has other controls; it must be read from this file"
        )


def _change(before: Aircraft, after: Aircraft) -> _Change:
    models = [SteadyModel(*folded(aircraft, aircraft.effect_values())) for aircraft in (before, after)]
    return _Change(models[0], replace(models[1], flight=models[0].level))


def _arms(change: _Change) -> bool:
    """Whether the thrust's line has changed."""
    old, new = change.before.aircraft.throttle, change.after.aircraft.throttle
    return old is not None and new is not None and (old.arm, old.inclination) != (new.arm, new.inclination)


#: How a parameter changes: set to a value, added to, or times a factor.
_Edit = tuple[str, float]


def _values(change: _Change, before: Aircraft) -> dict[str, _Edit]:
    edits: dict[str, _Edit] = {}
    for coefficient, name in NAMES.items():
        for regressor, suffix in {"0": "O", "alpha": "alpha", "beta": "beta", "p": "p", "q": "q", "r": "r"}.items():
            if (
                coefficient != "CD" or suffix == "q"
            ):  # of its drag rosflight_sim reads C_D_p, C_D_q and C_D_delta_e only
                edits[f"{name}_{suffix}"] = ("add", change.of(f"{coefficient}_{regressor}"))
        for symbol, (letter, sign) in CONTROLS.items():
            edits[f"{name}_delta_{letter}"] = ("add", sign * change.of(f"{coefficient}_{symbol}"))
    own, new = change.before.aircraft, change.after.aircraft
    pairs = {"mass": (own.mass, new.mass), **{f"J{axis[1:]}": (getattr(own.inertia, axis), getattr(new.inertia, axis))
                                              for axis in ("Ixx", "Iyy", "Izz", "Ixz")}}  # fmt: skip
    edits |= {name: ("set", value) for name, (old, value) in pairs.items() if value != old}
    edits |= dict.fromkeys(("CT_0", "CT_1", "CT_2"), ("times", _thrust_ratio(change)))
    lags = servo_lags(before, change.after.effects)
    if lags != servo_lags(before, change.before.effects) and lags:
        edits["servo_tau"] = ("set", sum(lags.values()) / len(lags) or NO_SERVO_LAG)
    return edits


def _thrust_ratio(change: _Change) -> float:
    sizes = []
    for model in (change.before, change.after):
        throttle = model.aircraft.throttle
        sizes.append((throttle.max_thrust or 1.0) * thrust_factor(model.effects) if throttle is not None else 1.0)
    return sizes[1] / sizes[0]


def _written(text: str, original: LoadFunction, change: _Change) -> Coefficients:
    """The coefficients of the aircraft before, with what the written parameters have other than the original."""
    with tempfile.TemporaryDirectory(prefix="sysid-") as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(text, encoding="utf-8")
        loads = rosflight_loads(path)
    aircraft = change.before.aircraft

    def coefficients(x: Columns) -> Array:
        states = states_of(x, aircraft)
        added = loads(states) - original(states)
        return change.before(x) + nondimensional(added, aircraft.reference.air_density, states, aircraft.geometry)

    return coefficients


def states_of(x: Columns, aircraft: Aircraft) -> PlantStates:
    """States by the regressors of an aircraft file."""
    g, half = aircraft.geometry, 2.0 * x["V"]
    rates = (x["p"] * half / g.b, x["q"] * half / g.cbar, x["r"] * half / g.b)
    controls = {symbol: x.get(symbol, 0.0 * half) for symbol in CONTROLS}
    return PlantStates(x["V"], x["alpha"], x["beta"], *rates, controls, 0.0 * half)


def _rewritten(text: str, path: Path, edits: Mapping[str, _Edit]) -> str:
    """The text with parameters changed wherever they stand; one that is not there is put before ``wing_s``."""
    for name, (how, amount) in edits.items():
        neutral = amount == (1.0 if how == "times" else 0.0) or (how == "add" and abs(amount) < 1e-12)
        if how != "set" and neutral:
            continue
        shown = _COMMENTS.get(name, name)
        line = re.compile(rf"^(?P<head>\s*{name}\s*:\s*|#\s*{shown}\s*:\s*)(?P<value>[-+0-9.eE]+)",
                          re.MULTILINE | (re.IGNORECASE if name in (*_COMMENTS, "mass") else 0))  # fmt: skip

        def changed(found: re.Match[str], how: str = how, amount: float = amount) -> str:
            old = float(found["value"])
            value = {"set": amount, "add": old + amount, "times": old * amount}[how]
            return found["head"] + number_text(value)

        text, count = line.subn(changed, text)
        if not count and how != "times":
            place = re.search(r"^(\s*)wing_s\s*:", text, re.MULTILINE)
            if place is None:
                raise InputError(f"{path}: wing_s stands in no line of its own; {name} cannot be put beside it")
            margin = place.group(1).rpartition("\n")[2]
            text = f"{text[: place.end(1)]}{name}: {number_text(amount)}\n{margin}{text[place.end(1) :]}"
    return text
