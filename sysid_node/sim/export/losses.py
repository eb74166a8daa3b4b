"""What a format cannot hold of an aircraft, one line each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.sim.effects import EFFECTS
from sysid_node.sim.export.steady import Coefficients, SteadyModel

Array = NDArray[np.float64]

#: The ordinary range of each variable about level flight: rad, non-dimensional rates, share of the airspeed, throttle.
_RANGES = {"alpha": (-0.1, 0.1), "beta": (-0.15, 0.15), "p": (-0.08, 0.08), "q": (-0.01, 0.01), "r": (-0.08, 0.08)}
_SPEEDS, _CONTROLS, _POINTS = (0.8, 1.2), 0.35, 13

#: A smaller difference of a coefficient is not said.
_SMALLEST = 2e-6

#: A smaller difference of two variables together is told without its size.
_NOTABLE = 1e-3

_UNITS = {"V": " m/s", "throttle": "", "p": "", "q": "", "r": ""}


def differences(file: SteadyModel, written: Coefficients) -> list[str]:
    """Where the coefficients (N, 6) that were written differ from the file's, a line for each variable or pair.

    Every variable moves by itself over its ordinary range about level flight, and each two of a table together.
    """

    def error(**columns: Array) -> Array:
        x = file.states(**columns)
        return np.asarray(written(x) - file(x))

    grids = {name: np.linspace(low, high, _POINTS) for name, (low, high) in ordinary_ranges(file).items()}
    here = file.here(written) - file.here(file)
    lines = [f"level flight: {told}" for told in [_sizes(here[None])] if told]
    alone = {name: error(**{name: grid}) - here for name, grid in grids.items()}
    for name, found in alone.items():
        told = _sizes(found)
        if told:
            grid = grids[name]
            lines.append(f"{name} from {grid[0]:.3g} to {grid[-1]:.3g}{_UNITS.get(name, ' rad')}: {told}")
    small = []
    for first, second in _pairs(file, grids):
        a, b = (each.ravel() for each in np.meshgrid(grids[first], grids[second], indexing="ij"))
        apart = (alone[first][:, None] + alone[second][None]).reshape(-1, 6)
        found = error(**{first: a, second: b}) - here - apart
        told = _sizes(found)
        if told and np.abs(found).max() >= _NOTABLE:
            lines.append(f"{first} and {second} together: {told} beyond what each differs by itself")
        elif told:
            small.append(f"{first} and {second}")
    if small:
        lines.append(f"two together, by less than {_NOTABLE:g} beyond what each differs by itself: {', '.join(small)}")
    return lines


def ordinary_ranges(file: SteadyModel) -> dict[str, tuple[float, float]]:
    """The range of each variable over which coefficients are compared."""
    level = file.level
    ranges = {name: (level[name] + low, level[name] + high) for name, (low, high) in _RANGES.items()}
    ranges["V"] = (_SPEEDS[0] * level["V"], _SPEEDS[1] * level["V"])
    for control in file.aircraft.controls.values():
        limit = min(control.limit or _CONTROLS, _CONTROLS)
        ranges[control.symbol] = (-limit, limit)
    throttle = file.aircraft.throttle
    return ranges | ({"throttle": (0.0, 1.0)} if throttle is not None and throttle.max_thrust is not None else {})


def _pairs(file: SteadyModel, known: Mapping[str, Array]) -> list[tuple[str, str]]:
    """Two variables of a table or an effect."""
    pairs = {tuple(sorted(table.over)) for table in file.aircraft.tables if len(table.over) == 2}
    if "lateral_alpha_coupling" in file.acting:
        pairs |= {("alpha", "beta"), ("alpha", "r")}
    if "propwash" in file.acting:
        pairs |= {tuple(sorted((s, v))) for s in ("de", "dr") for v in ("throttle", "V")}
    return [(a, b) for a, b in combinations(sorted(known), 2) if (a, b) in pairs]


def _sizes(error: Array) -> str:
    """The largest differences of those coefficients (N, 6) that differ; nothing where none does."""
    largest = np.abs(error).max(axis=0)
    told = [f"{c} by {size:.2g}" for c, size in zip(COEFFICIENTS, largest, strict=True) if size > _SMALLEST]
    return f"differs in {', '.join(told)}" if told else ""


def not_held(effects: Mapping[str, Mapping[str, float]], held: Iterable[str], why: Mapping[str, str]) -> list[str]:
    """A line for each effect that a format does not hold, with the reason."""
    lines = []
    for name, values in effects.items():
        if any(values.values()) and name not in held:
            lines.append(f"{name}: {reason(name, why.get(name, 'the format has nothing like it'))}")
    return lines


def reason(effect: str, otherwise: str) -> str:
    """Why a simulator's model does not hold an effect."""
    station = EFFECTS[effect].station
    if station in ("sensors", "clock"):
        return "it lies in the flight's instruments, not in the simulator"
    if station == "airflow":
        return "it lies in the air of that flight, not in the simulator"
    return otherwise


def late_failures(effects: Mapping[str, Mapping[str, float]]) -> list[str]:
    """A line for each failure that begins in the course of the flight."""
    late = [n for n in ("control_effectiveness_loss", "stuck_surface") if effects.get(n, {}).get("onset", -1.0) > 0.0]
    return [f"{name}: it begins in the course of the flight" for name in late]
